// Any text as a profile: no crash, every fault a line with its file and line; and what is accepted encodes and decodes.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "protocol/profile/describe.hpp"
#include "protocol/profile/read_profile.hpp"
#include "protocol/profile/records.hpp"

namespace selfcal::profile {
namespace {

void must(bool condition) {
  if (!condition) {
    std::abort();
  }
}

void check_faults(const std::string& message) {
  must(!message.empty());
  for (std::size_t at = 0; at < message.size();) {
    const std::size_t end = std::min(message.find('\n', at), message.size());
    must(message.substr(at, end - at).starts_with("p.toml:"));
    at = end + 1;
  }
}

// A value that its field does not hold is refused; one that it holds is what comes back from its bytes.
void use(const Profile& profile) {
  must(!describe(profile, Markup::markdown).empty());
  ins::StateRecord state;
  state.state = ins::State::complete;
  state.run_id = 7;
  state.power_cycles = 9;
  if (const auto bytes = encode(profile, state)) {
    static_cast<void>(decode_state(profile, *bytes));
  }
  flash::Page page;
  page.samples.resize(2);
  if (const auto bytes = encode_page(profile, page)) {
    must(bytes->size() == profile.raw.page.bytes);
    static_cast<void>(decode_page(profile, *bytes));
  }
  if (const auto bytes = encode(profile, ins::Coefficients{})) {
    static_cast<void>(decode_coefficients(profile, *bytes));
  }
  static_cast<void>(encode(profile, ins::ScheduleRecord{{{90'000, 0, 1000}}, 1000}));
  const Bytes zeros(profile.state.layout.bytes);
  static_cast<void>(decode_state(profile, zeros));
}

}  // namespace
}  // namespace selfcal::profile

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace selfcal::profile;
  const auto profile = parse_profile(std::string_view(reinterpret_cast<const char*>(data), size), "p.toml");
  if (!profile) {
    check_faults(profile.error().message);
  } else {
    use(**profile);
  }
  return 0;
}
