// The command line of a program: commands, options, their ranges, and how a wrong one is told. CLI11 does the parsing
// behind one source; it is heavy to compile.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/command_line/ranges.hpp"

namespace selfcal {

enum class Needed { no, yes };

// Options of a program or of one of its commands. NAMES are "NAME" for a positional argument, "--long" or
// "-s,--long" for an option. A variable keeps its value where its option is not given; that value is the default
// that --help shows (not for flags, empty text and nullopt). Variables must outlive the parsing.
class Options {
 public:
  Options(Options&&) noexcept;
  ~Options();

  void flag(const char* names, bool& value, const char* help);
  void text(const char* names, std::string& value, const char* help, Needed needed = Needed::no);
  // Repeated; a positional one takes several.
  void texts(const char* names, std::vector<std::string>& values, const char* help);
  void choice(const char* names, std::string& value, std::vector<std::string> known, const char* help);
  void number(const char* names, double& value, const Range& range, const char* help);
  void number(const char* names, std::optional<double>& value, const Range& range, const char* help);
  // COUNT numbers with commas between them.
  void numbers(const char* names, std::vector<double>& values, std::size_t count, const Range& range, const char* help);
  void whole(const char* names, std::uint64_t& value, const WholeRange& range, const char* help,
             Needed needed = Needed::no);
  void whole(const char* names, std::optional<std::uint64_t>& value, const WholeRange& range, const char* help);
  // CAN identifier: hexadecimal, with or without 0x, as can-utils read and write it.
  void can_identifier(const char* names, std::uint32_t& value, const char* help);
  void can_identifier(const char* names, std::optional<std::uint32_t>& value, const char* help);
  // Both together are refused; NAMES of options that were added before.
  void exclude(const char* name, const char* other);
  // Whatever else is given is taken and ignored.
  void take_anything();

  // A command below this one; with commands, one of them has to be given.
  Options command(const std::string& name, const std::string& description);
  bool chosen() const;  // after parsing

 private:
  friend class CommandLine;
  struct App;
  explicit Options(std::unique_ptr<App> app);
  std::unique_ptr<App> app_;
};

class CommandLine {
 public:
  // VERSION is what --version prints after the program's name.
  CommandLine(const std::string& program, const std::string& version, const std::string& description);
  ~CommandLine();

  Options& options();

  // nullopt: go on. Else the exit status: 0 after --help, --version, `help [COMMAND]` or `version`, 2 after a line on
  // standard error that names what was wrong.
  std::optional<int> parse(int argc, char** argv);

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

}  // namespace selfcal
