// The steps of the hub's schema, from schema/*.sql: element k takes it from version k to k + 1. A step that was released
// is never changed.
#pragma once

#include <span>
#include <string_view>

namespace selfcal::hub {

std::span<const std::string_view> migrations();

}  // namespace selfcal::hub
