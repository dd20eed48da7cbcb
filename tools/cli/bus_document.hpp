// The JSON document of `selfcal bus decode --json`.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "protocol/document/document_head.hpp"
#include "protocol/time.hpp"
#include "protocol/uds/decode.hpp"

namespace selfcal::cli {

class BusDocument {
 public:
  void add(const uds::LogEntry& entry);
  void add_error_frame(Time time, std::string_view words);
  // With its head. An input without a name stands for standard input.
  std::string text(const document::InputFile& input, std::uint64_t malformed) const;

 private:
  nlohmann::ordered_json entries_ = nlohmann::ordered_json::array();
};

}  // namespace selfcal::cli
