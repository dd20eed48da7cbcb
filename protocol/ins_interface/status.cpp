#include "protocol/ins_interface/status.hpp"

namespace selfcal::ins {

std::string_view name(State state) {
  switch (state) {
    case State::starting: return "starting";
    case State::idle: return "idle";
    case State::rotating: return "rotating";
    case State::complete: return "complete";
    case State::aborted: return "aborted";
    case State::failed: return "failed";
    case State::checking: return "checking";
  }
  return "unknown";
}

}  // namespace selfcal::ins
