// RequestUpload, TransferData and RequestTransferExit (ISO 14229-1, 14.3 to 14.5): the pages of the latest run.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "protocol/profile/profile.hpp"
#include "protocol/uds/messages.hpp"
#include "sim_ins/device/stores.hpp"

namespace selfcal::sim {

class RawUpload {
 public:
  // `longest_response` of TransferData, bytes.
  RawUpload(RawStore& raw, std::uint32_t longest_response, profile::ProfilePtr profile)
      : raw_(raw), longest_response_(longest_response), profile_(std::move(profile)) {}

  void forget();  // power-on, or a run that writes over what was uploaded
  void drop() { upload_.reset(); }
  bool active() const { return upload_.has_value(); }
  // Pages of which the tester has had every byte.
  std::uint32_t pages_served() const { return pages_served_; }

  [[nodiscard]] uds::Reply request(std::span<const std::uint8_t> request);
  // Fills `response`, whose capacity is kept; an empty reply is a positive one.
  [[nodiscard]] uds::Reply transfer(std::span<const std::uint8_t> request, uds::Bytes& response);
  // ReadMemoryByAddress (ISO 14229-1, 10.3), where the profile's raw data are asked for so.
  [[nodiscard]] uds::Reply memory(std::span<const std::uint8_t> request);
  // RequestFileTransfer (ISO 14229-1, 14.6), where each page is a file.
  [[nodiscard]] uds::Reply file(std::span<const std::uint8_t> request);
  [[nodiscard]] uds::Reply exit(std::span<const std::uint8_t> request);

 private:
  struct Upload {
    std::uint32_t first_page = 0, bytes = 0;
    std::uint32_t done = 0;  // bytes handed over
    std::uint8_t next_block = 1;
    std::uint32_t last_size = 0;  // of the block before, should it be asked for again
  };
  uds::Bytes data(const Upload& upload);  // of the block that begins at `done`
  std::span<const std::uint8_t> told_page(std::uint32_t page);
  std::uint32_t page_bytes() const { return static_cast<std::uint32_t>(profile_->raw.page.bytes); }

  RawStore& raw_;
  std::uint32_t longest_response_;
  profile::ProfilePtr profile_;
  std::optional<std::pair<std::uint32_t, uds::Bytes>> told_;  // the last page, in the profile's bytes
  std::optional<Upload> upload_;
  std::uint32_t pages_served_ = 0;
};

}  // namespace selfcal::sim
