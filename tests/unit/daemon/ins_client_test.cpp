// An INS whose answers make no sense: each dialogue ends with one line that begins with the interface.
#include "daemon/ins/ins_client.hpp"

#include <gtest/gtest.h>

#include <optional>

#include "protocol/uds/services.hpp"
#include "tests/unit/daemon/simulated_timers.hpp"

namespace selfcal {
namespace {

// Answers every request with the first two bytes of what should come: too short for all that holds a record. The
// callback comes from run(), as the loop's would.
class TersePort : public InsPort {
 public:
  void request(std::span<const std::uint8_t> payload, std::size_t, std::function<void(Answer<Bytes>)> done) override {
    answer_ = Bytes{static_cast<std::uint8_t>(payload[0] + uds::positive_offset),
                    payload.size() > 1 ? payload[1] : std::uint8_t{0}};
    done_ = std::move(done);
  }
  void cancel() override { done_ = nullptr; }
  void reopen() override {}
  void keep_session(bool) override {}
  void take_timings(const uds::SessionTimings&) override {}
  std::uint64_t lost_frames() const override { return 0; }
  std::string_view interface() const override { return "can7"; }

  void run() {
    while (done_) {
      std::exchange(done_, nullptr)(answer_);
    }
  }

 private:
  Bytes answer_;
  std::function<void(Answer<Bytes>)> done_;
};

template <typename T>
std::string complaint(TersePort& port, Task<Answer<T>> dialogue) {
  std::optional<Answer<T>> end;
  const auto keep = [](Task<Answer<T>> inner, std::optional<Answer<T>>& out) -> Task<bool> {
    out = co_await inner;
    co_return true;
  };
  Task<bool> task = keep(std::move(dialogue), end);
  task.start();
  port.run();
  return end && !*end ? end->error().message : "no complaint";
}

TEST(InsClient, SenselessAnswersNameTheInterface) {
  TersePort port;
  testing_support::SimulatedTimers timers;
  InsClient client(timers, port);
  const std::string lines[] = {complaint(port, client.identify()),
                               complaint(port, client.read_state()),
                               complaint(port, client.read_directory()),
                               complaint(port, client.read_site()),
                               complaint(port, client.read_sample_format()),
                               complaint(port, client.write_record(0xF190, {1, 2, 3})),
                               complaint(port, client.routine(uds::RoutineAction::start, 0x0200, {})),
                               complaint(port, client.upload(0, 1, [](std::uint32_t, const Expected<Bytes>&) {})),
                               complaint(port, client.unlock(UnlockKey{}))};
  for (const std::string& line : lines) {
    EXPECT_TRUE(line.starts_with("can7: ")) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace selfcal
