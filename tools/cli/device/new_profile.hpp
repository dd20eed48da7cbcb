// A profile to begin with: our own INS's, with what is asked of every INS answered.
#pragma once

#include <string>

#include "protocol/error.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::cli::device {

struct NewProfile {
  std::string name = "my_ins";
  std::string addressing = "normal";  // normal, normal-29, normal-fixed
  std::uint32_t request = profile::built_in()->bus.request, response = profile::built_in()->bus.response,
                functional = profile::built_in()->bus.functional;
  std::uint32_t ins_address = 0x2A, tester_address = 0xF1;  // normal-fixed
  std::string byte_order = "big";
  std::string security = "aes-cmac";   // none, program
  std::string records = "identifier";  // memory
  std::string rotation = "schedule";   // moves
  std::string raw_data = "upload";     // memory, file, stream
  std::string sets = "two";            // slots of coefficients; one
  std::string form = "errors";         // correction, correction-first
  bool operator==(const NewProfile&) const = default;
};

// Asks at the terminal what the profile begins with: the questions on standard error, for standard output is the profile's. An
// empty answer keeps what stands in brackets; at the end of the input the rest is kept.
void ask(NewProfile& answers);
// The profile, commented. Fails (usage) where the answers are no profile, with the reader's first fault.
[[nodiscard]] Expected<std::string> new_profile(const NewProfile& answers);

}  // namespace selfcal::cli::device
