// The man in the middle: takes every request of the tester, hands it to the INS, and passes the answer on as the rules
// have it. Two ends of ISO-TP and no I/O, so that it stands on two buses as well as in simulated time.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "protocol/isotp/transport.hpp"
#include "tests/hostile/rule.hpp"

namespace selfcal::hostile {

class Middle {
 public:
  // `link`: as the tester sees it, transmit_id the requests'. `cut_power` takes the INS's power away and gives it back.
  Middle(const isotp::Options& link, std::vector<Rule> rules, std::function<void()> cut_power);

  void from_tester(const can::CanFrame& frame, Time now);
  void from_ins(const can::CanFrame& frame, Time now);
  void on_time(Time now);
  // What may leave now.
  void take(std::vector<can::CanFrame>& to_tester, std::vector<can::CanFrame>& to_ins, Time now);
  std::optional<Time> next_deadline() const;

  // How often a rule did something: a case in which none did proves nothing.
  std::uint64_t acted() const { return acted_; }

 private:
  using View = std::span<const std::uint8_t>;
  struct Item {  // something for the tester, by time
    Time due{0};
    uds::Bytes bytes;
    bool raw = false;         // a frame, not a message
    std::uint32_t again = 0;  // so many times more
    Time every{0};
    bool power = false;  // not for the tester: the INS's power goes
    bool part = false;   // of an answer, which a new request ends
  };

  void take_request(Time now);
  void take_answer(Time now);
  // False where the answer is not to be sent by the usual way.
  bool change(const Rule& rule, uds::Bytes& answer, Time now, Time& delay, std::uint32_t& copies);
  void trickle(View answer, Time every, Time now);
  void tell(View message, Time now, Time delay, std::uint32_t again, Time every, bool raw = false);
  void pass_status(const can::CanFrame& frame);
  void flush(Time now);
  bool acts(std::size_t rule);

  std::uint32_t response_id_;
  std::uint32_t functional_id_;
  isotp::Transport tester_, ins_;
  std::vector<Rule> rules_;
  std::vector<std::uint32_t> seen_;  // by each rule
  std::function<void()> cut_power_;
  uds::Bytes request_, last_answer_;
  std::vector<std::size_t> active_;  // rules, on the request in hand
  std::vector<Item> items_;
  std::deque<uds::Bytes> messages_;  // for the tester
  std::deque<uds::Bytes> requests_;  // for the INS
  std::vector<can::CanFrame> frames_to_tester_, frames_to_ins_;
  std::uint64_t acted_ = 0;
};

}  // namespace selfcal::hostile
