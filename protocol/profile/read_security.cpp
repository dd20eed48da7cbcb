#include "protocol/profile/read_security.hpp"

#include <fmt/format.h>

#include <array>
#include <filesystem>

namespace selfcal::profile {
namespace {

constexpr std::array<std::string_view, 3> methods{"aes-cmac", "program", "none"};
constexpr std::array<std::string_view, 2> ways{"stdin", "argument"};
constexpr std::uint64_t most_bytes = 64;  // of a seed or a key
constexpr double least_limit_s = 0.1, most_limit_s = 60.0;

// From the folder of the profile on.
std::string from_folder_of(const std::string& profile, const std::string& program) {
  namespace fs = std::filesystem;
  return program.empty() ? program : (fs::path(profile).parent_path() / program).lexically_normal().string();
}

KeyProgram read_program(Section& section, Security& security) {
  KeyProgram program;
  const std::string file = section.text("program", true).value_or("");
  if (file.empty() && section.has("program")) {
    section.fault("program", "is empty");
  }
  program.file = from_folder_of(section.faults().file(), file);
  program.seed_as_argument = section.word("seed", ways).value_or("stdin") == "argument";
  program.limit_s = section.number("limit_s", least_limit_s, most_limit_s).value_or(program.limit_s);
  security.seed_bytes = section.whole("seed_bytes", 1, most_bytes, true).value_or(security.seed_bytes);
  security.key_bytes = section.whole("key_bytes", 1, most_bytes, true).value_or(security.key_bytes);
  program.key_bytes = security.key_bytes;
  return program;
}

}  // namespace

Security read_security(Section& section) {
  Security security;
  const std::string method = section.word("method", methods, true).value_or("none");
  security.needed = method != "none";
  const auto level = section.whole("level", 1, 0x41);
  if (level && *level % 2 == 0) {
    section.fault("level", fmt::format("{} is even: requestSeed is odd, sendKey the next", *level));
  }
  security.level = static_cast<std::uint8_t>(level.value_or(1));
  if (method == "program") {
    security.program = read_program(section, security);
  }
  section.only_these();
  return security;
}

}  // namespace selfcal::profile
