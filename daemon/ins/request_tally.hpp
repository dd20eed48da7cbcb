// The requests to an INS since the last progress, for the message that reports that there was none.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>

namespace selfcal {

class RequestTally {
 public:
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
  std::map<std::string, Entry> requests_;  // by name
  std::string last_;
};

// "ReadDataByIdentifier state", "RoutineControl start eraseInactiveSlot": the block counter and data left out.
std::string request_name(std::span<const std::uint8_t> request);

}  // namespace selfcal
