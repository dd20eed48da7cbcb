// What the tests of profiles do to the text of one.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

#include "protocol/profile/read_profile.hpp"

namespace selfcal::profile {

// Our own INS's: config/profiles/selfcal.toml.
inline std::string own_text() {
  std::ifstream in(SELFCAL_SOURCE_DIR "/config/profiles/selfcal.toml");
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

inline std::string with(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

// Empty: it has no fault.
inline std::string complaint(const std::string& text) {
  const auto profile = parse_profile(text, "p.toml");
  return profile ? std::string() : profile.error().message;
}

}  // namespace selfcal::profile
