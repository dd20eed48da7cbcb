// selfcal device odx: the profile for other diagnostic tools.
#include <fmt/format.h>

#include "protocol/odx/odx.hpp"
#include "tools/cli/device/bus_commands.hpp"
#include "tools/cli/device/odx_command.hpp"
#include "tools/cli/output_file.hpp"

namespace selfcal::cli::device {

Expected<int> write_odx(const std::string& file, const std::string& output) {
  if (const auto checked = check_output(output, {".pdx"}); !checked) {
    return tl::unexpected(checked.error());
  }
  const auto profile = chosen_profile(file);
  if (!profile) {
    return tl::unexpected(profile.error());
  }
  const auto made = odx::export_profile(**profile);
  if (!made) {
    return tl::unexpected(made.error());
  }
  if (const auto written = odx::write_pdx(*made, output); !written) {
    return tl::unexpected(written.error());
  }
  fmt::print("{}: {} services in {} files\n", output, made->services, made->files.size());
  fmt::print("what ODX cannot hold, and is not in it:\n");
  for (const std::string& what : made->lost) {
    fmt::print("  {}\n", what);
  }
  return 0;
}

}  // namespace selfcal::cli::device
