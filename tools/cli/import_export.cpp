// selfcal import, selfcal export: CSV to HDF5 and back, with every check that a reader makes.
#include <fmt/format.h>

#include <memory>

#include "protocol/recording/csv.hpp"
#include "protocol/recording/hdf5.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/output_file.hpp"

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

Expected<int> convert(const std::string& command, const ConvertArguments& arguments,
                      std::initializer_list<std::string_view> endings, Reader read, Writer write) {
  if (const auto known = check_output(arguments.to, endings); !known) {
    return tl::unexpected(known.error());
  }
  const Expected<LoadedRecording> loaded = read(arguments.from, lenient);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  for (const std::string& warning : loaded->warnings) {
    fmt::print(stderr, "selfcal {}: warning: {}: {}\n", command, arguments.from, warning);
  }
  return write(loaded->recording, arguments.to).map([] { return 0; });
}

std::shared_ptr<ConvertArguments> add_arguments(Options& options, const char* from, const char* to) {
  auto arguments = std::make_shared<ConvertArguments>();
  options.text("RECORDING", arguments->from, from, Needed::yes);
  options.text("-o,--output", arguments->to, to, Needed::yes);
  return arguments;
}

CommandRun configure_import(Options& options) {
  const auto arguments =
      add_arguments(options, "CSV file; its attributes in a TOML file of the same stem", "HDF5 file: .h5 or .hdf5");
  return [arguments] { return convert("import", *arguments, {".h5", ".hdf5"}, read_csv, write_hdf5); };
}

CommandRun configure_export(Options& options) {
  const auto arguments =
      add_arguments(options, "HDF5 file", "CSV file (.csv); the attributes go to a TOML file of the same stem");
  return [arguments] { return convert("export", *arguments, {".csv"}, read_hdf5, write_csv); };
}

const CommandRegistration import_registration{{"import", "CSV recording to HDF5", configure_import}};
const CommandRegistration export_registration{{"export", "HDF5 recording to CSV", configure_export}};

}  // namespace
}  // namespace selfcal::cli
