// An INS that has records in its memory (profile::RecordMemory), behind the port of one that has an identifier for each. A request
// to read or write such a record goes out as ReadMemoryByAddress or WriteMemoryByAddress, in as many parts as the INS tells or takes
// bytes at once, and is answered as if it had been one. All else goes through.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "daemon/ins/ins_port.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal {

class MemoryPort : public InsPort {
 public:
  MemoryPort(std::shared_ptr<InsPort> ins, profile::ProfilePtr profile);
  ~MemoryPort() override;

  void request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
               std::function<void(Answer<Bytes>)> done) override;
  void cancel() override;
  void reopen() override { ins_->reopen(); }
  void keep_session(bool keep) override { ins_->keep_session(keep); }
  void take_timings(const uds::SessionTimings& stated) override { ins_->take_timings(stated); }
  std::uint64_t lost_frames() const override { return ins_->lost_frames(); }
  std::string_view interface() const override { return ins_->interface(); }

 private:
  void ask_for_part();
  void take_part(const Answer<Bytes>& response);
  Expected<void> read_part(std::span<const std::uint8_t> response);
  void answer(Answer<Bytes> answer);
  PortError named(PortError error) const;

  std::shared_ptr<InsPort> ins_;
  profile::ProfilePtr profile_;

  // The request in hand.
  std::function<void(Answer<Bytes>)> done_;
  bool writes_ = false;
  std::uint16_t number_ = 0;
  profile::Region region_;
  Bytes record_;  // to write, or as far as it was read
  std::vector<profile::RegionPart> parts_;
  std::size_t part_ = 0;
};

}  // namespace selfcal
