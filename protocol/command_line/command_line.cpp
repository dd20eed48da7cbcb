#include "protocol/command_line/command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

#include "protocol/error.hpp"
#include "protocol/toml_file/nearest_word.hpp"

namespace selfcal {

struct Options::App {
  CLI::App* app = nullptr;
};

namespace {

constexpr int usage_status = static_cast<int>(ErrorKind::usage);
constexpr std::size_t longest_quote = 40;  // bytes of a wrong value that are repeated

// Ends the parsing; parse() prints the text.
[[noreturn]] void refuse(const std::string& text) { throw CLI::ValidationError(text); }

std::string shortened(const std::string& text) {
  return text.size() <= longest_quote ? text : text.substr(0, longest_quote) + "...";
}

// As the user knows the option: its long name, or that of the positional.
std::string name_of(const CLI::Option& option) { return option.get_name(option.get_positional()); }

double to_number(const std::string& name, const std::string& text, const Range& range) {
  double value = 0.0;
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(begin, end, value);
  const std::string unit = *range.unit == '\0' ? std::string() : fmt::format(" {}", range.unit);
  if (stopped != end || begin == end || error == std::errc::invalid_argument || std::isnan(value)) {
    refuse(fmt::format("{} {}: not a number; {:g} to {:g}{} is expected", name, shortened(text), range.least,
                       range.most, unit));
  }
  if (error != std::errc{} || value < range.least || value > range.most) {
    refuse(fmt::format("{} {}: outside {:g} to {:g}{}", name, shortened(text), range.least, range.most, unit));
  }
  return value;
}

std::uint64_t to_whole(const std::string& name, const std::string& text, const WholeRange& range) {
  std::uint64_t value = 0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  const bool digits =
      !text.empty() && text.find_first_not_of("0123456789", text.starts_with('-') ? 1 : 0) == std::string::npos;
  if (!digits) {
    refuse(
        fmt::format("{} {}: not a whole number; {} to {} is expected", name, shortened(text), range.least, range.most));
  }
  if (stopped != end || error != std::errc{} || value < range.least || value > range.most) {
    refuse(fmt::format("{} {}: outside {} to {}", name, shortened(text), range.least, range.most));
  }
  return value;
}

std::uint32_t to_can_identifier(const std::string& name, const std::string& text) {
  constexpr std::uint32_t largest = 0x1FFFFFFF;
  std::uint32_t value = 0;
  const char* begin = text.data() + (text.starts_with("0x") || text.starts_with("0X") ? 2 : 0);
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(begin, end, value, 16);
  if (error != std::errc{} || stopped != end || value > largest) {
    refuse(fmt::format("{} {}: a CAN identifier is expected, hexadecimal, 0 to {:X}", name, shortened(text), largest));
  }
  return value;
}

// An option with one value. TAKE gets the value's text and the option's name.
template <typename Take>
CLI::Option* add_value(CLI::App& app, const char* names, const char* help, const char* type, Take take,
                       const std::string& shown_default) {
  auto named = std::make_shared<CLI::Option*>(nullptr);
  *named = app.add_option(
      names,
      [named, take](const CLI::results_t& results) {
        take(results.front(), name_of(**named));
        return true;
      },
      help);
  (*named)->type_name(type)->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::Throw);
  if (!shown_default.empty()) {
    (*named)->default_str(shown_default);
  }
  return *named;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      names.push_back("--" + name);
    }
  }
  return names;
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  return names;
}

// The deepest command that was given.
const CLI::App& deepest(const CLI::App& app) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  return chosen.empty() ? app : deepest(*chosen.front());
}

// What stood on the command line and belongs to nothing.
std::string about_unknown(const CLI::App& app) {
  const CLI::App& at = deepest(app);
  std::vector<std::string> left = at.remaining();
  if (left.empty()) {
    left = app.remaining(true);
  }
  if (left.empty()) {
    return "an argument too many";
  }
  std::string word = left.front();
  if (word.starts_with('-')) {
    word = word.substr(0, word.find('='));
    return fmt::format("no option {}{}", shortened(word), did_you_mean(word, option_names(at)));
  }
  const std::vector<std::string> commands = command_names(at);
  return commands.empty() ? fmt::format("{}: one argument too many", shortened(word))
                          : fmt::format("no command {}{}", shortened(word), did_you_mean(word, commands));
}

std::string about_missing_command(const CLI::App& app) {
  const CLI::App& at = deepest(app);
  const std::vector<std::string> left = at.remaining();
  return left.empty() ? fmt::format("a command is expected: {}", fmt::join(command_names(at), ", "))
                      : about_unknown(app);
}

}  // namespace

Options::Options(std::unique_ptr<App> app) : app_(std::move(app)) {}
Options::Options(Options&&) noexcept = default;
Options::~Options() = default;

void Options::flag(const char* names, bool& value, const char* help) {
  app_->app->add_flag_callback(
      names, [&value] { value = true; }, help);
}

void Options::text(const char* names, std::string& value, const char* help, Needed needed) {
  add_value(
      *app_->app, names, help, "TEXT", [&value](const std::string& text, const std::string&) { value = text; }, value)
      ->required(needed == Needed::yes);
}

void Options::texts(const char* names, std::vector<std::string>& values, const char* help) {
  CLI::Option* option = app_->app->add_option(
      names,
      [&values](const CLI::results_t& results) {
        values = results;
        return true;
      },
      help);
  option->type_name("TEXT")->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  option->expected(1, CLI::detail::expected_max_vector_size)->allow_extra_args(option->get_positional());
}

void Options::choice(const char* names, std::string& value, std::vector<std::string> known, const char* help) {
  add_value(
      *app_->app, names, help, "TEXT",
      [&value, known = std::move(known)](const std::string& text, const std::string& name) {
        if (std::find(known.begin(), known.end(), text) == known.end()) {
          refuse(fmt::format("{} {}: one of {} is expected{}", name, shortened(text), fmt::join(known, ", "),
                             did_you_mean(text, known)));
        }
        value = text;
      },
      value);
}

void Options::number(const char* names, double& value, const Range& range, const char* help) {
  add_value(
      *app_->app, names, help, "NUMBER",
      [&value, &range](const std::string& text, const std::string& name) { value = to_number(name, text, range); },
      fmt::format("{:g}", value));
}

void Options::number(const char* names, std::optional<double>& value, const Range& range, const char* help) {
  add_value(
      *app_->app, names, help, "NUMBER",
      [&value, &range](const std::string& text, const std::string& name) { value = to_number(name, text, range); }, "");
}

void Options::numbers(const char* names, std::vector<double>& values, std::size_t count, const Range& range,
                      const char* help) {
  add_value(
      *app_->app, names, help, "NUMBERS",
      [&values, count, &range](const std::string& text, const std::string& name) {
        const std::vector<std::string> parts = CLI::detail::split(text, ',');
        if (parts.size() != count) {
          refuse(fmt::format("{} {}: {} numbers with commas between them are expected", name, shortened(text), count));
        }
        values.clear();
        for (const std::string& part : parts) {
          values.push_back(to_number(name, part, range));
        }
      },
      fmt::format("{:g}", fmt::join(values, ",")));
}

void Options::whole(const char* names, std::uint64_t& value, const WholeRange& range, const char* help, Needed needed) {
  add_value(
      *app_->app, names, help, "NUMBER",
      [&value, &range](const std::string& text, const std::string& name) { value = to_whole(name, text, range); },
      needed == Needed::yes ? std::string() : fmt::format("{}", value))
      ->required(needed == Needed::yes);
}

void Options::whole(const char* names, std::optional<std::uint64_t>& value, const WholeRange& range, const char* help) {
  add_value(
      *app_->app, names, help, "NUMBER",
      [&value, &range](const std::string& text, const std::string& name) { value = to_whole(name, text, range); }, "");
}

void Options::can_identifier(const char* names, std::uint32_t& value, const char* help) {
  add_value(
      *app_->app, names, help, "HEX",
      [&value](const std::string& text, const std::string& name) { value = to_can_identifier(name, text); },
      fmt::format("{:X}", value));
}

void Options::can_identifier(const char* names, std::optional<std::uint32_t>& value, const char* help) {
  add_value(
      *app_->app, names, help, "HEX",
      [&value](const std::string& text, const std::string& name) { value = to_can_identifier(name, text); }, "");
}

void Options::exclude(const char* name, const char* other) {
  app_->app->get_option(name)->excludes(app_->app->get_option(other));
}

void Options::take_anything() { app_->app->allow_extras(); }

Options Options::command(const std::string& name, const std::string& description) {
  app_->app->require_subcommand(1);
  return Options(std::make_unique<App>(App{app_->app->add_subcommand(name, description)}));
}

bool Options::chosen() const { return app_->app->parsed(); }

struct CommandLine::Parser {
  Parser(const std::string& program, const std::string& version, const std::string& description)
      : app(description, program), options(std::make_unique<Options::App>(Options::App{&app})), words(program) {
    app.set_version_flag("--version", program + " " + version);
  }

  int tell(const std::string& text) const {
    std::string at = words;
    for (const CLI::App* below = &app; !below->get_subcommands().empty();) {
      below = below->get_subcommands().front();
      at += " " + below->get_name();
    }
    fmt::print(stderr, "{}: {}\n", at, text);
    return usage_status;
  }

  CLI::App app;
  Options options;
  std::string words;
};

CommandLine::CommandLine(const std::string& program, const std::string& version, const std::string& description)
    : parser_(std::make_unique<Parser>(program, version, description)) {}

CommandLine::~CommandLine() = default;

Options& CommandLine::options() { return parser_->options; }

std::optional<int> CommandLine::parse(int argc, char** argv) {
  CLI::App& app = parser_->app;
  std::vector<std::string> arguments(argv + std::min(argc, 1), argv + argc);
  // `help COMMAND` is COMMAND --help, and `version` is --version; both are commands only where there are commands.
  const std::vector<std::string> commands = command_names(app);
  if (!commands.empty()) {
    app.add_subcommand("help", "what the program, or the COMMAND after it, can do");
    app.add_subcommand("version", "the version of the program");
    const bool of_help_itself = arguments.size() > 1 && arguments[1].starts_with('-');
    if (!arguments.empty() && arguments.front() == "help" && !of_help_itself) {
      arguments.erase(arguments.begin());
      // --help would be obeyed before a wrong word is noticed.
      for (const CLI::App* at = &app; const std::string& word : arguments) {
        const std::vector<std::string> below = command_names(*at);
        if (std::find(below.begin(), below.end(), word) == below.end()) {
          return parser_->tell(fmt::format("help: no command {}{}", shortened(word), did_you_mean(word, below)));
        }
        at = at->get_subcommand(word);
      }
      arguments.emplace_back("--help");
    } else if (arguments == std::vector<std::string>{"version"}) {
      arguments = {"--version"};
    }
  }
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 takes them
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ExtrasError&) {
    return parser_->tell(about_unknown(app));
  } catch (const CLI::RequiredError& error) {
    const CLI::App& at = deepest(app);
    const bool command_missing = !command_names(at).empty() && at.get_subcommands().empty();
    const std::vector<std::string> left = at.remaining();
    const bool misspelt = !left.empty() && left.front().starts_with('-');  // what is missing may be what it was to be
    return parser_->tell(misspelt ? about_unknown(app) : command_missing ? about_missing_command(app) : error.what());
  } catch (const CLI::ParseError& error) {
    return parser_->tell(error.what());
  }
  return std::nullopt;
}

}  // namespace selfcal
