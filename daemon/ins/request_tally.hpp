// The requests to an INS since the last progress, for the message that reports that there was none.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "protocol/profile/profile.hpp"

namespace selfcal {

class RequestTally {
 public:
  explicit RequestTally(profile::ProfilePtr profile) : profile_(std::move(profile)) {}
  void asked(std::span<const std::uint8_t> request);
  void failed(std::span<const std::uint8_t> request, const std::string& why);
  void forget();  // there was progress

  // The request that failed most often, or the last one where none failed: "TransferData, asked 12 times (can0: no
  // answer to TransferData within 1 s)". Empty where nothing was asked.
  std::string words() const;

 private:
  struct Entry {
    int asked = 0;
    int failed = 0;
    std::string why;  // it failed last
  };
  profile::ProfilePtr profile_;
  std::map<std::string, Entry> requests_;  // by name
  std::string last_;
};

// "ReadDataByIdentifier state", "RoutineControl start erase", as the profile calls them: the block counter and data left out.
std::string request_name(const profile::Profile& profile, std::span<const std::uint8_t> request);

}  // namespace selfcal
