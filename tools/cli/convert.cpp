#include "tools/cli/convert.hpp"

#include <fmt/format.h>

#include "tools/cli/output_file.hpp"

namespace selfcal::cli {

Expected<int> convert(const std::string& command, const std::string& from, const std::string& to,
                      std::initializer_list<std::string_view> endings, const RecordingReader& read,
                      const RecordingWriter& write) {
  if (const auto known = check_output(to, endings); !known) {
    return tl::unexpected(known.error());
  }
  const Expected<LoadedRecording> loaded = read(from, lenient);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  for (const std::string& warning : loaded->warnings) {
    fmt::print(stderr, "selfcal {}: warning: {}: {}\n", command, from, warning);
  }
  return write(loaded->recording, to).map([] { return 0; });
}

}  // namespace selfcal::cli
