// The INS's services, request by request: records, routines, upload, power cycles.
#include "tests/unit/sim_ins/diagnostics_fixture.hpp"

namespace selfcal::sim {
namespace {

using namespace std::chrono_literals;

TEST_F(DiagnosticsTest, LiteralAnswers) {
  EXPECT_EQ(ask({0x22, 0xF1, 0x8C}), (uds::Bytes{0x62, 0xF1, 0x8C, 'S', 'I', 'M', '-', '0', '0', '0', '1'}));
  EXPECT_EQ(ask({0x22, 0xAB, 0xCD}), (uds::Bytes{0x7F, 0x22, 0x31}));
  EXPECT_EQ(ask({0x22, 0xF1}), (uds::Bytes{0x7F, 0x22, 0x13}));
  EXPECT_EQ(ask({0x3E, 0x00}), (uds::Bytes{0x7E, 0x00}));
  EXPECT_EQ(ask({0x99}), (uds::Bytes{0x7F, 0x99, 0x11}));
  EXPECT_EQ(ask({0x10, 0x04}), (uds::Bytes{0x7F, 0x10, 0x12}));
  EXPECT_EQ(ask({0x36, 0x01}), (uds::Bytes{0x7F, 0x36, 0x7F}));
}

TEST_F(DiagnosticsTest, LockedByDefaultAndAgainAfterEachChange) {
  EXPECT_EQ(nrc_of(schedule(1000)), Nrc::service_not_supported_in_session);
  ASSERT_EQ(nrc_of(uds::session_request(uds::Session::extended)), Nrc::none);
  EXPECT_EQ(nrc_of(schedule(1000)), Nrc::security_access_denied);
  EXPECT_EQ(nrc_of(start(routine::self_calibration, 1)), Nrc::security_access_denied);
  EXPECT_EQ(nrc_of(uds::routine_request(uds::RoutineAction::start, routine::erase_inactive)),
            Nrc::security_access_denied);
  unlock();
  EXPECT_EQ(nrc_of(schedule(1000)), Nrc::none);
  diagnostics_->session_expired(time());
  EXPECT_EQ(nrc_of(schedule(1000)), Nrc::service_not_supported_in_session);
  unlock();
  power_cycle();
  EXPECT_FALSE(diagnostics_->unlocked());
}

TEST_F(DiagnosticsTest, RotationFillsPagesThatCanBePulledWhileItTurns) {
  unlock();
  EXPECT_EQ(nrc_of(start(routine::self_calibration, 7)), Nrc::conditions_not_correct);  // no schedule
  ASSERT_EQ(nrc_of(schedule(20000)), Nrc::none);
  ASSERT_EQ(nrc_of(start(routine::self_calibration, 7)), Nrc::none);
  EXPECT_EQ(nrc_of(start(routine::self_calibration, 8)), Nrc::conditions_not_correct);  // turns already
  EXPECT_EQ(nrc_of(schedule(1000)), Nrc::conditions_not_correct);
  run_for(22.5);  // in the move: 1125 samples, 7 pages of 145
  EXPECT_EQ(instrument_->status().state, ins::State::rotating);
  EXPECT_TRUE(instrument_->status().moving);
  EXPECT_EQ(instrument_->raw().pages_written(), 7U);
  EXPECT_EQ(nrc_of(uds::upload_request(6, 2 * flash::page_bytes)), Nrc::request_out_of_range);
  ASSERT_EQ(nrc_of(uds::upload_request(5, 2 * flash::page_bytes)), Nrc::none);
  uds::Bytes data;
  for (std::uint8_t block = 1; data.size() < 2 * flash::page_bytes; ++block) {
    EXPECT_EQ(nrc_of(uds::transfer_request(static_cast<std::uint8_t>(block + 1))), Nrc::wrong_block_sequence_counter);
    const uds::Bytes answer = ask(uds::transfer_request(block));
    ASSERT_GT(answer.size(), 2U);
    EXPECT_EQ(ask(uds::transfer_request(block)), answer);  // asked for again: the same bytes
    data.insert(data.end(), answer.begin() + 2, answer.end());
  }
  ASSERT_EQ(data.size(), 2 * flash::page_bytes);
  EXPECT_EQ(nrc_of(uds::transfer_exit_request()), Nrc::none);
  for (std::uint32_t k = 0; k < 2; ++k) {
    flash::Page page;
    ASSERT_TRUE(flash::decode_page(std::span(data).subspan(k * flash::page_bytes, flash::page_bytes), page));
    EXPECT_EQ(page.run_id, 7U);
    EXPECT_EQ(page.sequence, 5 + k);
    EXPECT_EQ(page.first_sample, (5 + k) * 145U);
    EXPECT_EQ(page.samples.size(), 145U);
  }
  run_for(30.0);
  EXPECT_EQ(instrument_->status().state, ins::State::complete);
  const ins::DirectoryRecord directory = instrument_->raw().directory();
  EXPECT_EQ(directory.samples, 45U * 50U);
  EXPECT_EQ(directory.pages_written, directory.pages_expected);
  EXPECT_TRUE(directory.complete);
}

TEST_F(DiagnosticsTest, PagesOutliveAPowerCycle) {
  unlock();
  ASSERT_EQ(nrc_of(schedule(20000)), Nrc::none);
  ASSERT_EQ(nrc_of(start(routine::self_calibration, 7)), Nrc::none);
  run_for(10.0);
  power_cycle();
  const ins::DirectoryRecord directory = instrument_->raw().directory();
  EXPECT_EQ(directory.run_id, 7U);
  EXPECT_EQ(directory.pages_written, 3U);  // 500 samples: the fourth page was not full
  EXPECT_TRUE(directory.complete);
  EXPECT_EQ(instrument_->status().state, ins::State::idle);
}

TEST_F(DiagnosticsTest, CoefficientsGoThroughEraseWriteCommitAndPowerCycle) {
  unlock();
  const auto bytes = ins::encode(set_of(3));
  const uds::Bytes write = uds::write_request(did::coefficients_inactive, bytes);
  const uds::Bytes erase = uds::routine_request(uds::RoutineAction::start, routine::erase_inactive);
  ASSERT_EQ(nrc_of(write), Nrc::none);
  EXPECT_NE(nrc_of(write), Nrc::none);  // not erased since
  ASSERT_EQ(nrc_of(erase), Nrc::none);
  auto spoilt = bytes;
  spoilt[100] ^= 1;
  EXPECT_EQ(nrc_of(uds::write_request(did::coefficients_inactive, spoilt)), Nrc::request_out_of_range);
  ASSERT_EQ(nrc_of(write), Nrc::none);
  EXPECT_EQ(nrc_of(start(routine::commit_coefficients, 0x12345678)), Nrc::request_out_of_range);
  power_cycle();  // written, not committed
  EXPECT_EQ(instrument_->state_record().in_force, ins::Slot::factory);
  unlock();
  ASSERT_EQ(nrc_of(start(routine::commit_coefficients, ins::stored_crc(bytes))), Nrc::none);
  EXPECT_EQ(instrument_->state_record().in_force, ins::Slot::factory);  // until the next power-on
  power_cycle();
  EXPECT_EQ(instrument_->state_record().coefficients_version, 3U);
  EXPECT_EQ(instrument_->coefficients().in_force(), set_of(3));
}

TEST_F(DiagnosticsTest, ResetIsAskedForAndCounted) {
  const std::uint32_t before = instrument_->state_record().power_cycles;
  unlock();
  EXPECT_EQ(ask({0x11, 0x01}), (uds::Bytes{0x51, 0x01}));
  EXPECT_TRUE(diagnostics_->take_reset_request());
  EXPECT_FALSE(diagnostics_->take_reset_request());
  power_cycle();
  EXPECT_EQ(instrument_->state_record().power_cycles, before + 1);
}

// A block is erased in 45 ms, up to 256 bytes are programmed in 0.8 ms: a set takes two such writes, its mark one.
// Nothing is answered before it is done.
TEST_F(DiagnosticsTest, WritesTakeTheTimeOfTheChip) {
  static_assert(ins::coefficients_bytes > flash_program_bytes && ins::coefficients_bytes <= 2 * flash_program_bytes);
  const auto seconds = [&](const uds::Bytes& request) {
    const double begin = now_s_;
    EXPECT_EQ(nrc_of(request), Nrc::none);
    return now_s_ - begin;
  };
  const auto bytes = ins::encode(set_of(3));
  unlock();
  constexpr double step = 0.0001;  // of ask()
  EXPECT_NEAR(seconds(uds::routine_request(uds::RoutineAction::start, routine::erase_inactive)), 0.045, 1.01 * step);
  EXPECT_NEAR(seconds(uds::write_request(did::coefficients_inactive, bytes)), 0.0016, 1.01 * step);
  EXPECT_NEAR(seconds(start(routine::commit_coefficients, ins::stored_crc(bytes))), 0.0008, 1.01 * step);
  EXPECT_EQ(seconds(uds::read_request(did::coefficients_inactive)), 0.0);
}

// The power goes at every moment of erase, record and commit, 47.4 ms in steps of 0.1 ms: no request is answered before its
// write is in the chip, and a complete set is in force each time.
TEST_F(DiagnosticsTest, PowerCutAtEveryMomentOfAnInstallation) {
  unlock();
  const auto bytes = ins::encode(set_of(1));
  const std::array requests{uds::routine_request(uds::RoutineAction::start, routine::erase_inactive),
                            uds::write_request(did::coefficients_inactive, bytes),
                            start(routine::commit_coefficients, ins::stored_crc(bytes))};
  constexpr double step_s = 0.0001;
  int committed = 0;
  for (int k = 0; k < 480 && committed == 0; ++k) {
    const double cut_s = now_s_ + k * step_s;
    bool all_answered = true;
    for (const uds::Bytes& request : requests) {
      uds::Bytes response;
      ASSERT_EQ(diagnostics_->handle(request, response, time()), uds::RequestHandler::Answer::later);
      std::optional<uds::Bytes> answer;
      while (!(answer = diagnostics_->take_answer()) && now_s_ < cut_s) {
        run_for(std::min(step_s, cut_s - now_s_));
      }
      all_answered = answer.has_value();
      if (!all_answered) {
        break;
      }
      ASSERT_EQ((*answer)[0], request[0] + 0x40) << k;
    }
    power_cycle();
    const bool renewed = instrument_->state_record().coefficients_version == 1;
    EXPECT_EQ(instrument_->coefficients().in_force(), renewed ? set_of(1) : factory()) << k;
    // The mark is one word; its last byte may be one that programming leaves as erasure left it, no more than that.
    EXPECT_TRUE(renewed || !all_answered) << k;
    EXPECT_TRUE(!renewed || k >= 470) << k;
    committed += renewed ? 1 : 0;
    unlock();
  }
  EXPECT_EQ(committed, 1);
}

// Drift at rest: with Table 3's errors kilometres in ten minutes' time scale, with them compensated only what noise
// and quantisation leave: g/2 (VRW, ARW) and 1e-6 of what the coefficients' last digits hold.
TEST_F(DiagnosticsTest, TrueCoefficientsStopTheDrift) {
  const auto drift = [&] {
    ins::NavigationCheckRequest request;
    request.duration_s = 600;
    request.compensation = ins::Slot::a;
    EXPECT_EQ(nrc_of(uds::routine_request(uds::RoutineAction::start, routine::navigation_check, ins::encode(request))),
              Nrc::none);
    run_for(601.0);
    EXPECT_TRUE(instrument_->navigation_check().done);
    return instrument_->navigation_check().max_horizontal_m;
  };
  unlock();
  const double before = drift();
  ins::Coefficients set = set_of(1);
  set.value = *true_sensor_errors(small(), 1);
  const auto bytes = ins::encode(set);
  ASSERT_EQ(nrc_of(uds::write_request(did::coefficients_inactive, bytes)), Nrc::none);
  ASSERT_EQ(nrc_of(start(routine::commit_coefficients, ins::stored_crc(bytes))), Nrc::none);
  power_cycle();
  unlock();
  const double after = drift();
  // 100 ug for 600 s, 2 axes, Schuler-bent: some 150 m. ARW 0.001 deg/sqrt(h): 7e-6 rad in 600 s, g/2 of its integral:
  // under 3 m; VRW 5 ug/sqrt(Hz): 5e-5 m/s/sqrt(s) t^1.5/sqrt(3): 0.4 m.
  EXPECT_GT(before, 50.0);
  EXPECT_LT(after, 10.0);
}

}  // namespace
}  // namespace selfcal::sim
