// selfcal device new | lint | describe | dbc | odx | check | probe: what an INS speaks, by its profile.
#include <fmt/format.h>

#include <unistd.h>

#include <memory>

#include "protocol/profile/dbc_file.hpp"
#include "protocol/profile/describe.hpp"
#include "protocol/profile/read_profile.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/device/bus_commands.hpp"
#include "tools/cli/device/new_profile.hpp"
#include "tools/cli/device/odx_command.hpp"

namespace selfcal::cli {
namespace {

struct Arguments {
  std::string file, output;
  bool html = false;
};

// On a terminal, where no option tells, it asks.
Expected<int> begin(device::NewProfile& answers, bool told) {
  if (!told && ::isatty(STDIN_FILENO) == 1 && ::isatty(STDERR_FILENO) == 1) {
    device::ask(answers);
  }
  const auto text = device::new_profile(answers);
  if (!text) {
    return tl::unexpected(text.error());
  }
  fmt::print("{}", *text);
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

Expected<int> describe(const Arguments& arguments) {
  const auto profile = device::chosen_profile(arguments.file);
  if (!profile) {
    return tl::unexpected(profile.error());
  }
  fmt::print("{}", profile::describe(**profile, arguments.html ? profile::Markup::html : profile::Markup::markdown));
  return 0;
}

Expected<int> write_dbc(const Arguments& arguments) {
  const auto profile = device::chosen_profile(arguments.file);
  if (!profile) {
    return tl::unexpected(profile.error());
  }
  fmt::print("{}", profile::dbc_text(**profile));
  return 0;
}

void configure_check(Options& options, device::CheckArguments& arguments) {
  options.text("INTERFACE", arguments.interface, "CAN interface, for example can0", Needed::yes);
  options.text("--profile", arguments.profile, "what the INS speaks, TOML; without it selfcal's own");
  options.text("--key-file", arguments.key_file, "key that opens the lock, 32 hexadecimal digits");
  options.flag("--write", arguments.write, "try also what writes, restarts the INS or sends a wrong key");
  options.flag("--all", arguments.all, "what was sent and came also where a requirement holds");
  options.flag("--json", arguments.json, "as JSON");
}

void configure_new(Options& options, device::NewProfile& answers) {
  options.text("--name", answers.name, "of the INS");
  options.choice("--addressing", answers.addressing, {"normal", "normal-29", "normal-fixed"}, "of ISO 15765-2");
  options.can_identifier("--request-id", answers.request, "CAN identifier, tester to INS, hexadecimal");
  options.can_identifier("--response-id", answers.response, "INS to tester, hexadecimal");
  options.can_identifier("--functional-id", answers.functional, "tester to all, hexadecimal");
  options.can_identifier("--ins-address", answers.ins_address, "normal-fixed: address of the INS, hexadecimal");
  options.can_identifier("--tester-address", answers.tester_address,
                         "normal-fixed: address of the tester, hexadecimal");
  options.choice("--byte-order", answers.byte_order, {"big", "little"}, "of its numbers");
  options.choice("--security", answers.security, {"aes-cmac", "program", "none"}, "what opens its lock");
  options.choice("--records", answers.records, {"identifier", "memory"}, "by what they are asked for");
  options.choice("--rotation", answers.rotation, {"schedule", "moves"}, "what its gimbal is told");
  options.choice("--raw-data", answers.raw_data, {"upload", "memory", "file", "stream"}, "how they come");
  options.choice("--sets", answers.sets, {"two", "one"}, "of coefficients that it keeps beside the factory's");
  options.choice("--form", answers.form, {"errors", "correction", "correction-first"}, "what the 24 mean");
}

void configure_probe(Options& options, device::ProbeArguments& arguments) {
  options.text("INTERFACE", arguments.interface, "CAN interface, for example can0", Needed::yes);
  options.text("--profile", arguments.profile, "whose address is asked first, TOML; without it selfcal's own");
  options.flag("--only", arguments.only, "ask no other address");
  options.can_identifier("--first-did", arguments.first_did, "first data identifier to read, hexadecimal");
  options.can_identifier("--last-did", arguments.last_did, "last one, hexadecimal");
  options.number("--listen", arguments.listen_s, range::waiting, "listen so long before anything is sent");
  options.flag("--json", arguments.json, "as JSON");
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  auto new_options = std::make_shared<Options>(
      options.command("new", "a profile to begin with, on standard output; without options it asks at a terminal"));
  auto answers = std::make_shared<device::NewProfile>();
  configure_new(*new_options, *answers);
  auto lint_options = std::make_shared<Options>(
      options.command("lint", "every fault of a profile, a line each; status 1 if there is one"));
  lint_options->text("FILE", arguments->file, "profile, TOML", Needed::yes);
  auto describe_options = std::make_shared<Options>(
      options.command("describe", "the profile as an interface control document, with pictures of its bytes"));
  describe_options->text("FILE", arguments->file, "profile, TOML", Needed::yes);
  describe_options->flag("--html", arguments->html, "as one HTML page; without it Markdown");
  auto dbc_options = std::make_shared<Options>(options.command("dbc", "identifiers and status frames as a DBC"));
  dbc_options->text("FILE", arguments->file, "profile, TOML", Needed::yes);
  auto odx_options = std::make_shared<Options>(
      options.command("odx", "services and records as ODX 2.2 for other diagnostic tools; says what ODX cannot hold"));
  odx_options->text("FILE", arguments->file, "profile, TOML", Needed::yes);
  odx_options->text("-o,--output", arguments->output, "archive, .pdx", Needed::yes);
  auto checking = std::make_shared<device::CheckArguments>();
  auto check_options = std::make_shared<Options>(options.command(
      "check", "whether an INS does what its profile, ISO 14229-1 and ISO 15765-2 ask; status 1 if not"));
  configure_check(*check_options, *checking);
  auto probing = std::make_shared<device::ProbeArguments>();
  auto probe_options = std::make_shared<Options>(options.command(
      "probe", "which addresses answer on a bus and what they tell, by reading alone; status 1 if none"));
  configure_probe(*probe_options, *probing);
  return [=]() -> Expected<int> {
    if (probe_options->chosen()) {
      return device::probe(*probing);
    }
    if (check_options->chosen()) {
      return device::check(*checking);
    }
    if (new_options->chosen()) {
      return begin(*answers, *answers != device::NewProfile{});
    }
    if (dbc_options->chosen()) {
      return write_dbc(*arguments);
    }
    if (odx_options->chosen()) {
      return device::write_odx(arguments->file, arguments->output);
    }
    return lint_options->chosen() ? lint(*arguments) : describe(*arguments);
  };
}

const CommandRegistration registration{{"device", "what an INS speaks: check and describe its profile", configure}};

}  // namespace
}  // namespace selfcal::cli
