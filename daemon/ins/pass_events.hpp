// A port before another one: what the inner one hears without being asked is heard by whoever asks the outer one.
#pragma once

#include "daemon/ins/ins_port.hpp"

namespace selfcal {

// Until the inner port's callbacks are set anew; `outer` must live as long.
inline void pass_events(InsPort& inner, const InsPort& outer) {
  inner.on_bus_event = [&outer](can::BusEvent event) {
    if (outer.on_bus_event) {
      outer.on_bus_event(event);
    }
  };
  inner.on_status = [&outer](const ins::Status& status) {
    if (outer.on_status) {
      outer.on_status(status);
    }
  };
}

}  // namespace selfcal
