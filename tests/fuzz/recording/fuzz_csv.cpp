// The CSV reader on any bytes: up to the first line "---" the attributes (TOML), behind it the samples. It must return;
// what it calls a sound recording must be one.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "protocol/recording/csv.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::string_view border = "---\n";
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t at = text.find(border);
  const std::string_view attributes = text.substr(0, at);
  const std::string_view samples = at == std::string_view::npos ? "" : text.substr(at + border.size());
  for (const bool strict : {true, false}) {
    const selfcal::CheckPolicy policy{.gaps_are_errors = strict, .gimbal_contradiction_is_error = strict};
    const auto read = selfcal::parse_csv(samples, attributes, "fuzz.csv", policy);
    if (read && !selfcal::check_recording(read->recording, policy)) {
      std::abort();
    }
    if (!read && (read.error().message.empty() || read.error().message.find('\n') != std::string::npos)) {
      std::abort();  // an error is one line
    }
  }
  return 0;
}
