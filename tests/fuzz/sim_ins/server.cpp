// The whole server of the virtual INS, transport to FLASH, fed with whatever a tester and a supply may do to it. Input,
// operation after operation, first byte & 7:
//   0, 1  a frame on the request or the functional identifier: one byte of length, the data
//   2     a whole message, cut into frames as ISO 15765-2 has it: one byte of length, the message
//   3     time passes: one byte, in steps of 20 ms
//   4     the lock is opened as the owner of the key does
//   5     power off and on
//   6     the power will go after so many bytes of FLASH: two bytes, big-endian
//   7     one byte: odd, a commit of what the inactive slot holds; even, a sound set of this version into that slot
// Whatever comes: a complete set is in force, no answer is longer than it may be, and while the lock was never opened no
// coefficient changes and nothing turns.
#include <cstdlib>

#include "protocol/byte_order.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/unit/sim_ins/virtual_unit.hpp"

using namespace selfcal;
using namespace std::chrono_literals;

namespace {

constexpr uds::SecurityKey key{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
constexpr std::size_t most_operations = 200;

class Scene {
 public:
  explicit Scene(sim::VirtualUnit& unit) : unit_(unit) {
    // Cheaper than a new memory of 33 MB; without a header of the run no old page counts.
    unit_.flash().lose_power_after(std::nullopt);
    for (std::size_t block = 0; block < sim::raw_ring_first_block; ++block) {
      unit_.flash().erase(block);
    }
    now_ = std::chrono::ceil<std::chrono::milliseconds>(std::chrono::duration<double>(unit_.flash().ready_at_s()));
    unit_.power_on(now_);  // the chip lives on from input to input, and so does its clock
    pass(1500ms);
    before_ = coefficient_blocks();
  }

  void run(std::span<const std::uint8_t> input) {
    for (std::size_t i = 0; i < most_operations && !input.empty(); ++i) {
      try {
        input = operate(input);
        answer();
      } catch (const sim::PowerLost&) {
        restart();
      }
      check();
    }
  }

 private:
  using View = std::span<const std::uint8_t>;

  View operate(View input) {
    const std::uint8_t operation = input[0] & 7U;
    input = input.subspan(1);
    const std::size_t size = input.empty() || operation > 2 ? 0 : std::min<std::size_t>(input[0], input.size() - 1);
    switch (operation) {
      case 0:
      case 1: {
        const std::size_t bytes = std::min(size, can::max_classic_bytes);
        give(input.subspan(input.empty() ? 0 : 1, bytes), operation == 1);
        return input.subspan(input.empty() ? 0 : 1 + bytes);
      }
      case 2:
        give_message(input.subspan(input.empty() ? 0 : 1, size));
        return input.subspan(input.empty() ? 0 : 1 + size);
      case 3: pass(input.empty() ? Time{20ms} : Time{20ms} * input[0]); return input.subspan(input.empty() ? 0 : 1);
      case 4: open_lock(); return input;
      case 5: restart(); return input;
      case 6:
        if (input.size() >= 2) {
          unit_.flash().lose_power_after(ByteReader(input).get<std::uint16_t>());
          return input.subspan(2);
        }
        return {};
      default:
        if (!input.empty()) {
          (input[0] & 1U) != 0 ? commit() : write_set(input[0]);
        }
        return input.subspan(input.empty() ? 0 : 1);
    }
  }

  void give(View data, bool functional) {
    can::CanFrame frame;
    frame.id = functional ? ins::can_id::functional : ins::can_id::request;
    frame.size = static_cast<std::uint8_t>(data.size());
    std::ranges::copy(data, frame.data.begin());
    unit_.on_frame(frame, now_);
  }

  void give_message(View message) {
    isotp::Options options;
    options.address = {ins::can_id::request, ins::can_id::response, std::nullopt, false};
    options.max_message = 4095;
    isotp::Transport tester(options);
    if (!tester.send(message, now_)) {
      return;
    }
    while (tester.sending()) {
      can::CanFrame frame;
      while (tester.pending({&frame, 1}, now_) == 1) {
        unit_.on_frame(frame, now_);
        tester.sent(1, now_);
      }
      unit_.step(now_);
      for (std::size_t n = unit_.pending({&frame, 1}, now_); n == 1; n = unit_.pending({&frame, 1}, now_)) {
        tester.on_frame(frame, now_);
        unit_.sent(1, now_);
      }
      now_ += 10ms;
      tester.on_time(now_);  // gives up where no flow control comes: the INS starts, or sends to somebody else
    }
  }

  // What the INS has to say: the first of its frames, and all of the answer where the tester lets it.
  void answer() {
    can::CanFrame frame;
    for (int i = 0; i < 700; ++i) {  // 4095 bytes in frames of 7, and some more
      unit_.step(now_);
      note_lock();
      if (unit_.pending({&frame, 1}, now_) == 0) {
        return;
      }
      if (frame.id != ins::can_id::response || frame.size > can::max_classic_bytes) {
        std::abort();
      }
      const bool first = frame.data[0] >> 4 == 1;
      if (first && ((frame.data[0] & 15U) << 8 | frame.data[1]) > 4095) {
        std::abort();
      }
      unit_.sent(1, now_);
      now_ += 130us;
    }
    std::abort();  // no answer is as long as that
  }

  void pass(Time time) {
    for (const Time end = now_ + time; now_ < end; now_ += 20ms) {
      unit_.step(now_);
      note_lock();
    }
  }

  // A key is judged when its attempt stands in the FLASH: later than it was given.
  void note_lock() { opened_ = opened_ || unit_.diagnostics().unlocked(); }

  uds::Bytes ask(const uds::Bytes& request) {
    uds::Bytes response;
    unit_.diagnostics().handle(request, response, now_);
    return response;
  }

  void open_lock() {
    if (!unit_.instrument().ready()) {
      return;
    }
    ask(uds::session_request(uds::Session::extended));
    const uds::Bytes response = ask(uds::seed_request());
    if (const auto seed = uds::read_seed_response(response)) {
      ask(uds::key_request(*uds::answer_seed(key, *seed)));
      pass(120ms);  // the attempt is counted, then judged
    }
    note_lock();
  }

  void commit() {
    if (const auto set = unit_.instrument().coefficients().inactive()) {
      uds::Bytes option(4);
      ByteWriter(option).put(ins::stored_crc(ins::encode(*set)));
      ask(uds::routine_request(uds::RoutineAction::start, ins::routine::commit_coefficients, option));
    }
  }

  void write_set(std::uint8_t version) {
    ins::Coefficients set;
    set.version = version;
    set.author = "fuzz";
    ask(uds::write_request(ins::did::coefficients_inactive, ins::encode(set)));
  }

  void restart() {
    unit_.power_on(now_);  // with a supply that holds
    pass(100ms);
  }

  uds::Bytes coefficient_blocks() {
    uds::Bytes all;
    for (std::size_t block = 0; block < 3; ++block) {  // factory, A, B
      const auto bytes = unit_.flash().read(block * sim::flash_block_bytes, sim::flash_block_bytes);
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
    return all;
  }

  void check() {
    const auto bytes = ins::encode(unit_.instrument().coefficients().in_force());
    if (!ins::decode_coefficients(bytes)) {
      std::abort();
    }
    if (!opened_ && (unit_.instrument().busy() || coefficient_blocks() != before_)) {
      std::abort();
    }
  }

  sim::VirtualUnit& unit_;
  Time now_{0};
  bool opened_ = false;
  uds::Bytes before_;
};

sim::VirtualUnit make_unit() {
  sim::SimConfig config;
  config.sample_rate_hz = 50.0;
  sim::DiagnosticOptions options;
  options.key = key;
  options.seed_salt = 99;
  return {config, std::move(*sim::FlashMemory::open("", sim::flash_bytes)), options};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static sim::VirtualUnit unit = make_unit();
  Scene(unit).run({data, size});
  return 0;
}
