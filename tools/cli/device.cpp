// selfcal device new | lint | describe | dbc: what an INS speaks, by its profile.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "protocol/ins_interface/dbc.hpp"
#include "protocol/profile/built_in_text.hpp"
#include "protocol/profile/describe.hpp"
#include "protocol/profile/read_profile.hpp"
#include "tools/cli/command.hpp"

namespace selfcal::cli {
namespace {

struct Arguments {
  std::string file, name = "my_ins";
  bool html = false;
};

// Our own INS's, under another name: whole, and to be changed line by line with lint at hand.
Expected<int> begin(const Arguments& arguments) {
  const std::string_view text = profile::built_in_text();
  const std::string head = "name = \"selfcal\"";
  const std::size_t at = text.find(head);
  fmt::print(
      "# What an INS speaks. It begins as selfcal's own INS; change what yours has otherwise, and delete what it does "
      "not tell.\n"
      "#\n"
      "# A field: at (byte, from 0), type (u8 u16 u24 u32 u64 i8 i16 i24 i32 i64 f32 f64, ascii with length), count "
      "(elements),\n"
      "# byte_order, first_bit and bits (of an unsigned integer), scale, offset, unit, codes (words to numbers), "
      "constant.\n"
      "# A field that is no role's needs a constant: magic numbers, versions, reserved bytes.\n"
      "#\n"
      "#   selfcal device lint FILE        every fault, with its line\n"
      "#   selfcal device describe FILE    what it says, with pictures of the bytes\n"
      "#   sim_ins --profile FILE          a virtual INS that speaks so\n"
      "name = \"{}\"{}",
      arguments.name, text.substr(at + head.size()));
  return 0;
}

// A fault each line of standard output: they are the answer, not an error of the command.
Expected<int> lint(const Arguments& arguments) {
  const auto profile = profile::load_profile(arguments.file);
  if (profile) {
    fmt::print("{}: no fault\n", arguments.file);
    return 0;
  }
  if (profile.error().message.find('\n') == std::string::npos &&
      profile.error().message.ends_with("cannot be opened")) {
    return tl::unexpected(profile.error());
  }
  fmt::print("{}\n", profile.error().message);
  return 1;
}

// As an error is told: one line.
Expected<profile::ProfilePtr> load(const std::string& file) {
  auto profile = profile::load_profile(file);
  if (profile) {
    return profile;
  }
  const std::string& faults = profile.error().message;
  const auto more = std::ranges::count(faults, '\n');
  return fail(profile.error().kind,
              faults.substr(0, faults.find('\n')) +
                  (more > 0 ? fmt::format(" (and {} more: selfcal device lint)", more) : std::string()));
}

Expected<int> describe(const Arguments& arguments) {
  const auto profile = load(arguments.file);
  if (!profile) {
    return tl::unexpected(profile.error());
  }
  fmt::print("{}", profile::describe(**profile, arguments.html ? profile::Markup::html : profile::Markup::markdown));
  return 0;
}

Expected<int> write_dbc(const Arguments& arguments) {
  const auto profile = load(arguments.file);
  if (!profile) {
    return tl::unexpected(profile.error());
  }
  const profile::Bus& bus = (*profile)->bus;
  fmt::print("{}", ins::dbc_text({bus.request, bus.response, bus.functional, bus.status, bus.extended_ids}));
  return 0;
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  auto new_options = std::make_shared<Options>(options.command("new", "a profile to begin with, on standard output"));
  new_options->text("--name", arguments->name, "of the INS");
  auto lint_options = std::make_shared<Options>(
      options.command("lint", "every fault of a profile, a line each; status 1 if there is one"));
  lint_options->text("FILE", arguments->file, "profile, TOML", Needed::yes);
  auto describe_options = std::make_shared<Options>(
      options.command("describe", "the profile as an interface control document, with pictures of its bytes"));
  describe_options->text("FILE", arguments->file, "profile, TOML", Needed::yes);
  describe_options->flag("--html", arguments->html, "as one HTML page; without it Markdown");
  auto dbc_options = std::make_shared<Options>(options.command("dbc", "identifiers and status frames as a DBC"));
  dbc_options->text("FILE", arguments->file, "profile, TOML", Needed::yes);
  return [arguments, new_options, lint_options, describe_options, dbc_options]() -> Expected<int> {
    if (new_options->chosen()) {
      return begin(*arguments);
    }
    if (dbc_options->chosen()) {
      return write_dbc(*arguments);
    }
    return lint_options->chosen() ? lint(*arguments) : describe(*arguments);
  };
}

const CommandRegistration registration{{"device", "what an INS speaks: check and describe its profile", configure}};

}  // namespace
}  // namespace selfcal::cli
