// selfcal import, selfcal export: CSV to HDF5 and back, with every check that a reader makes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "protocol/recording/csv.hpp"
#include "protocol/recording/hdf5.hpp"
#include "tools/cli/command.hpp"

namespace selfcal::cli {
namespace {

struct ConvertArguments {
  std::string from;
  std::string to;
};

// Data faults that an estimate refuses may be carried from one form into the other.
constexpr CheckPolicy lenient{.gaps_are_errors = false, .gimbal_contradiction_is_error = false};

using Reader = Expected<LoadedRecording> (*)(const std::filesystem::path&, const CheckPolicy&);
using Writer = Expected<void> (*)(const Recording&, const std::filesystem::path&);

Expected<int> convert(const std::string& command, const ConvertArguments& arguments, Reader read, Writer write) {
  const Expected<LoadedRecording> loaded = read(arguments.from, lenient);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  for (const std::string& warning : loaded->warnings) {
    fmt::print(stderr, "selfcal {}: warning: {}: {}\n", command, arguments.from, warning);
  }
  return write(loaded->recording, arguments.to).map([] { return 0; });
}

std::shared_ptr<ConvertArguments> add_arguments(CLI::App& app, const char* from, const char* to) {
  auto arguments = std::make_shared<ConvertArguments>();
  app.add_option("RECORDING", arguments->from, from)->required();
  app.add_option("-o,--output", arguments->to, to)->required();
  return arguments;
}

CommandRun configure_import(CLI::App& app) {
  const auto arguments = add_arguments(app, "CSV file; its attributes in a TOML file of the same stem", "HDF5 file");
  return [arguments] { return convert("import", *arguments, read_csv, write_hdf5); };
}

CommandRun configure_export(CLI::App& app) {
  const auto arguments = add_arguments(app, "HDF5 file", "CSV file; the attributes go to a TOML file of the same stem");
  return [arguments] { return convert("export", *arguments, read_hdf5, write_csv); };
}

const CommandRegistration import_registration{{"import", "CSV recording to HDF5", configure_import}};
const CommandRegistration export_registration{{"export", "HDF5 recording to CSV", configure_export}};

}  // namespace
}  // namespace selfcal::cli
