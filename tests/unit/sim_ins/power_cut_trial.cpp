// The power goes at random instants of whole calibrations, half of them inside the writing of coefficients:
//   power_cut_trial [CUTS] [SEED]
// A tester calibrates the INS over UDS, ISO-TP and a 1 Mbit/s bus in simulated time: unlock, schedule, rotation, pages
// pulled while it turns, erase, write, commit, reset, read-back. After each cut the INS must come up with exactly one
// complete set, that before the cut or the one committed, and the next calibration must run to its end with the same
// raw data, bit for bit, as one without a cut. Prints the counts; status 1 where one fails.
#include <fmt/format.h>

#include <cstdlib>
#include <vector>

#include "protocol/byte_order.hpp"
#include "protocol/can/bus_load.hpp"
#include "protocol/uds/client.hpp"
#include "sim_ins/random.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/own_ins/records.hpp"
#include "tests/unit/sim_ins/virtual_unit.hpp"

namespace selfcal::sim {
namespace {

using namespace std::chrono_literals;
namespace did = ins::did;
namespace routine = ins::routine;

constexpr uds::SecurityKey key{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
constexpr std::array phases{"unlock", "rotation", "rest of the data", "erase", "record", "commit", "reset"};
enum Phase : std::size_t { unlocking, rotating, pulling, erasing, writing, committing, resetting };

SimConfig small() {
  SimConfig config;
  config.sample_rate_hz = 50.0;
  return config;
}

DiagnosticOptions diagnostics() {
  DiagnosticOptions options;
  options.key = key;
  options.seed_salt = 7;
  return options;
}

isotp::Options tester_link() {
  isotp::Options options;
  options.address = {ins::can_id::request, ins::can_id::response, ins::can_id::functional, false};
  options.max_message = 4095;
  return options;
}

struct Failed {
  std::string why;
};

// When the power goes: from a moment on, or when a phase begins, after so many more bytes of FLASH.
struct Cut {
  std::optional<Time> at;
  std::optional<Phase> phase;
  std::uint64_t bytes = 0;
};

class Trial {
 public:
  Trial()
      : unit_(small(), std::move(*FlashMemory::open("", flash_bytes)), diagnostics()),
        client_(tester_link(), uds::ClientTimings{}) {
    unit_.power_on(now_);
  }

  // One calibration. Throws PowerLost at the cut, Failed where anything is not as it should be.
  void calibrate(const Cut& cut) {
    cut_ = cut;
    begun_ = now_;
    wait_until_ready();
    enter(unlocking);
    unlock();
    pull_run();
    install();
    while (cut_.at || off_at_) {
      pause(10ms);  // the cut comes right after the end
    }
    cut_ = {};
  }

  // After a cut. True where the new set is in force.
  bool come_up() {
    // The commit is one word. With two bytes or more of it missing nothing is committed; the fourth alone may be one
    // that programming leaves as erasure left it.
    if (cut_.phase == committing && cut_.bytes < 3) {
      may_be_in_force_ = false;
    }
    cut_ = {};
    off_at_.reset();
    client_.cancel();
    unit_.power_on(now_);
    wait_until_ready();
    const auto set = read_set(did::coefficients_in_force);
    const auto state = ins::decode_state(record(did::state));
    if (!state || (state->faults & ins::fault::coefficients) != 0) {
      throw Failed{"the INS reports a fault of its coefficients"};
    }
    const bool renewed = set == candidate_ && may_be_in_force_;
    if (!renewed && (set != installed_ || must_be_in_force_)) {
      throw Failed{fmt::format("version {} in force, {} expected", set.version, installed_.version)};
    }
    installed_ = set;
    may_be_in_force_ = must_be_in_force_ = false;
    return renewed;
  }

  std::size_t phase() const { return phase_; }
  Time elapsed() const { return now_ - begun_; }
  bool within_a_write() const { return within_write_; }

 private:
  void enter(Phase phase) {
    phase_ = phase;
    if (cut_.phase == phase) {
      unit_.flash().lose_power_after(cut_.bytes);
    }
  }

  // One turn of bus and INS; the outcome of the tester's request, if it ended.
  std::optional<uds::Outcome> turn() {
    if (cut_.at && now_ >= begun_ + *cut_.at) {  // the supply sags: it may die in the next write, else soon
      unit_.flash().lose_power_after(cut_.bytes);
      off_at_ = now_ + 200ms;
      cut_.at.reset();
    }
    if (off_at_ && now_ >= *off_at_) {
      within_write_ = unit_.flash().busy();
      throw PowerLost{};
    }
    within_write_ = true;  // whatever throws from here on is the FLASH
    std::optional<uds::Outcome> outcome = client_.on_time(now_);
    std::size_t count = client_.pending(frames_, now_);
    for (std::size_t i = 0; i < count; ++i) {
      now_ = bus_.transmit(frames_[i], now_);
      unit_.on_frame(frames_[i], now_);
    }
    if (count > 0 && !outcome) {
      outcome = client_.sent(count, now_);
    }
    unit_.step(now_);
    const std::size_t answered = unit_.pending(frames_, now_);
    for (std::size_t i = 0; i < answered && !outcome; ++i) {
      now_ = bus_.transmit(frames_[i], now_);
      outcome = client_.on_frame(frames_[i], now_);
    }
    unit_.sent(answered, now_);
    if (count + answered == 0) {
      now_ += 10ms;
    }
    return outcome;
  }

  void pause(Time time) {
    for (const Time end = now_ + time; now_ < end;) {
      static_cast<void>(turn());
    }
  }

  uds::Bytes ask(const uds::Bytes& request) {
    if (!client_.request(request, now_)) {
      throw Failed{"the tester is still sending"};
    }
    while (true) {
      const auto outcome = turn();
      if (!outcome) {
        continue;
      }
      if (outcome->kind != uds::Outcome::Kind::positive) {
        throw Failed{fmt::format("{}: {}", uds::service_name(request[0]),
                                 outcome->kind == uds::Outcome::Kind::negative ? uds::describe_nrc(outcome->nrc)
                                                                               : isotp::name(outcome->why))};
      }
      return {outcome->response.begin(), outcome->response.end()};
    }
  }

  uds::Bytes record(std::uint16_t id) {
    const uds::Bytes response = ask(uds::read_request(id));
    return {response.begin() + 3, response.end()};
  }
  ins::Coefficients read_set(std::uint16_t id) {
    const auto set = ins::decode_coefficients(record(id));  // checks length and CRC
    if (!set) {
      throw Failed{set.error().message};
    }
    return *set;
  }
  void start(std::uint16_t id, std::optional<std::uint32_t> word = {}) {
    uds::Bytes option(word ? 4 : 0);
    if (word) {
      ByteWriter(option).put(*word);
    }
    ask(uds::routine_request(uds::RoutineAction::start, id, option));
  }

  void wait_until_ready() { pause(1500ms); }  // it starts for a second

  void unlock() {
    ask(uds::session_request(uds::Session::extended));
    const auto seed = uds::read_seed_response(ask(uds::seed_request()));
    ask(uds::key_request(*uds::answer_seed(key, *seed)));
  }

  void pull_run() {
    ins::ScheduleRecord schedule;
    schedule.positions = {{0, 0, 5000}, {90000, 0, 5000}};
    schedule.rotation_ms = 5000;
    ask(uds::write_request(did::schedule, ins::encode(schedule)));
    enter(rotating);
    // Numbers of runs come again: what an earlier run of the same number left must not be taken for this one's.
    start(routine::self_calibration, run_id);
    uds::Bytes data;
    while (true) {
      const auto directory = ins::decode_directory(record(did::raw_data_directory));
      if (!directory || directory->run_id != run_id) {
        throw Failed{"the directory is of another run"};
      }
      if (directory->complete) {
        enter(pulling);
      }
      upload(directory->pages_written, data);
      if (directory->complete) {
        break;
      }
      pause(1s);
    }
    if (reference_.empty()) {
      reference_ = data;
    }
    if (data != reference_) {
      throw Failed{fmt::format("raw data differ from those of an undisturbed run: {} bytes, {} expected", data.size(),
                               reference_.size())};
    }
  }

  void upload(std::uint32_t pages, uds::Bytes& data) {
    const auto have = static_cast<std::uint32_t>(data.size() / flash::page_bytes);
    if (pages == have) {
      return;
    }
    const std::size_t wanted = pages * flash::page_bytes;
    ask(uds::upload_request(have, static_cast<std::uint32_t>(wanted - data.size())));
    for (std::uint8_t block = 1; data.size() < wanted; ++block) {
      const uds::Bytes answer = ask(uds::transfer_request(block));
      data.insert(data.end(), answer.begin() + 2, answer.end());
    }
    ask(uds::transfer_exit_request());
    flash::Page page;
    for (std::uint32_t k = have; k < pages; ++k) {
      const auto bytes = std::span(data).subspan(k * flash::page_bytes, flash::page_bytes);
      if (!flash::decode_page(bytes, page) || page.run_id != run_id || page.sequence != k) {
        throw Failed{fmt::format("page {} is not whole or of another run", k)};
      }
    }
  }

  void install() {
    candidate_ = {};
    candidate_.version = installed_.version + 1;
    candidate_.author = "power cut trial";
    candidate_.value.fill(1e-6 * candidate_.version);
    const auto bytes = ins::encode(candidate_);
    enter(erasing);
    start(routine::erase_inactive);
    enter(writing);
    ask(uds::write_request(did::coefficients_inactive, bytes));
    enter(committing);
    may_be_in_force_ = true;  // from the moment the last byte of the mark stands, answered or not
    start(routine::commit_coefficients, ins::stored_crc(bytes));
    must_be_in_force_ = true;
    enter(resetting);
    ask(uds::Bytes{uds::service::ecu_reset, static_cast<std::uint8_t>(uds::ResetType::hard)});
    wait_until_ready();
    if (read_set(did::coefficients_in_force) != candidate_) {
      throw Failed{"the committed set is not in force"};
    }
    installed_ = candidate_;
    may_be_in_force_ = must_be_in_force_ = false;
  }

  static constexpr std::uint32_t run_id = 7;

  Time now_{0}, begun_{0};
  VirtualUnit unit_;
  uds::Client client_;
  can::BusClock bus_{{1'000'000, 5'000'000}};
  std::array<can::CanFrame, 16> frames_{};
  Cut cut_;
  std::optional<Time> off_at_;
  Phase phase_ = unlocking;
  bool within_write_ = false;
  bool may_be_in_force_ = false, must_be_in_force_ = false;
  ins::Coefficients installed_ = factory(), candidate_;
  uds::Bytes reference_;  // raw data of the first run

  static ins::Coefficients factory() {
    ins::Coefficients set;
    set.author = "factory";
    return set;
  }
};

// Bytes of FLASH that each phase of the coefficients takes: a block's erasure, a record, the mark.
constexpr std::array coefficient_bytes{flash_block_bytes, ins::coefficients_bytes, std::size_t{4}};

Cut draw(int k, Time whole, Random& random) {
  Cut cut;
  if (k % 2 == 0) {
    const auto which = static_cast<std::size_t>(k / 2 % 3);
    cut.phase = static_cast<Phase>(erasing + which);
    cut.bytes = static_cast<std::uint64_t>(random.uniform() * static_cast<double>(coefficient_bytes[which]));
  } else {
    cut.at = std::chrono::duration_cast<Time>(whole * random.uniform());
    cut.bytes = static_cast<std::uint64_t>(random.uniform() * 2.0 * flash_block_bytes);
  }
  return cut;
}

int run(int cuts, std::uint64_t seed) {
  Trial trial;
  trial.calibrate({});  // the reference
  const Time whole = trial.elapsed();
  Random random(seed, 1);
  std::array<int, phases.size()> by_phase{};
  int within_writes = 0;
  int renewed = 0;
  for (int k = 0; k < cuts; ++k) {
    const Cut cut = draw(k, whole, random);
    try {
      try {
        trial.calibrate(cut);
        throw Failed{"the power did not go"};
      } catch (const PowerLost&) {
        ++by_phase[trial.phase()];
        within_writes += trial.within_a_write() ? 1 : 0;
      }
      renewed += trial.come_up() ? 1 : 0;
      trial.calibrate({});
    } catch (const Failed& failed) {
      fmt::print("cut {} of seed {}, in phase {}: {}\n", k, seed, phases[trial.phase()], failed.why);
      return 1;  // what stands in the FLASH is not known any more
    }
  }
  fmt::print("seed {}: {} power cuts, {} while the FLASH was being written;", seed, cuts, within_writes);
  for (std::size_t i = 0; i < phases.size(); ++i) {
    fmt::print(" {} {}{}", phases[i], by_phase[i], i + 1 < phases.size() ? "," : "\n");
  }
  fmt::print("{} times one complete set in force afterwards ({} old, {} new), {} next calibrations complete\n", cuts,
             cuts - renewed, renewed, cuts);
  return 0;
}

}  // namespace
}  // namespace selfcal::sim

int main(int argc, char** argv) {
  const int cuts = argc > 1 ? std::atoi(argv[1]) : 1000;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  if (cuts <= 0) {
    fmt::print(stderr, "usage: power_cut_trial [CUTS] [SEED]\n");
    return 2;
  }
  return selfcal::sim::run(cuts, seed);
}
