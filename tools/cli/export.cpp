// selfcal export: HDF5 recording to CSV, with every check that a reader makes.
#include <memory>

#include "protocol/recording/csv.hpp"
#include "protocol/recording/hdf5.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/convert.hpp"

namespace selfcal::cli {
namespace {

struct ExportArguments {
  std::string from;
  std::string to;
};

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<ExportArguments>();
  options.text("RECORDING", arguments->from, "HDF5 file", Needed::yes);
  options.text("-o,--output", arguments->to, "CSV file (.csv); the attributes go to a TOML file of the same stem",
               Needed::yes);
  return [arguments] { return convert("export", arguments->from, arguments->to, {".csv"}, read_hdf5, write_csv); };
}

const CommandRegistration registration{{"export", "HDF5 recording to CSV", configure}};

}  // namespace
}  // namespace selfcal::cli
