#include "protocol/profile/read_move.hpp"

#include <fmt/format.h>

#include "protocol/profile/read_layout.hpp"

namespace selfcal::profile {
namespace {

constexpr std::uint64_t most_number = 0xFFFF;

void check_end_of_move(Section& section, Section& root, const Layout& state, bool by_angle) {
  if (!section.has("there") || !root.has("state")) {
    return;
  }
  const auto need = [&](std::string_view name) {
    if (state.find(name) == nullptr) {
      root.faults().add(root.line_of("state"), fmt::format("state.fields.{}", name),
                        fmt::format("missing, and a move is over by {} (line {})", by_angle ? "angle" : "state",
                                    section.line_of("there")));
    }
  };
  if (by_angle) {
    need("outer");
    need("inner");
  } else {
    need("gimbal_moving");
  }
}

}  // namespace

Move read_move(Section& section, Section& root, const Profile& profile, ByteOrder order,
               std::optional<std::uint16_t> number) {
  Move move;
  const std::string_view other = section.has("did") ? "did" : "memory";
  if (section.has("routine") && section.has(other)) {
    section.fault("routine",
                  fmt::format("and {} (line {}): a move is commanded in one way", other, section.line_of(other)));
  } else if (!section.has("routine") && !section.has(other)) {
    section.fault("did", "missing, and there is no routine and no memory in its place");
  }
  if (const auto routine = section.whole("routine", 1, most_number)) {
    move.routine = static_cast<std::uint16_t>(*routine);
  }
  move.did = number;
  move.turning = read_turning(section);
  Record record;
  read_layout(section, record_role("move"), order, record);
  if (!record.given.empty()) {
    section.fault("given", "a move has no such values");
  }
  section.only_these();
  move.layout = std::move(record.layout);
  check_end_of_move(section, root, profile.state.layout, move.turning.by_angle);
  return move;
}

}  // namespace selfcal::profile
