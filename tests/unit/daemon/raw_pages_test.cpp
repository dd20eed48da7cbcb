// Raw data that contradict themselves, with a CRC that is right: pages against each other and the directory, the directory
// against the time that the rotation took.
#include "daemon/run/ins_checks.hpp"
#include "daemon/run/rotation_clock.hpp"
#include "protocol/byte_order.hpp"
#include "protocol/uds/messages.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/own_ins/records.hpp"
#include "tests/unit/daemon/calibration_run_fixture.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::CalibrationRunTest;
using testing_support::FakeIns;

constexpr std::uint64_t full = flash::samples_per_page;

class RawPagesTest : public CalibrationRunTest {
 protected:
  // Page `number`, `times` times.
  void alter_page(std::uint32_t number, int times, const std::function<void(flash::Page&)>& change) {
    ins_.alter = [=, left = times](std::span<const std::uint8_t> request, Answer<Bytes>& answer) mutable {
      flash::Page page;
      if (request[0] != uds::service::transfer_data || !answer ||
          !flash::decode_page(std::span(*answer).subspan(2), page) || page.sequence != number || left-- <= 0) {
        return;
      }
      change(page);
      flash::encode_page(page, std::span(*answer).subspan(2).first<flash::page_bytes>());
    };
  }
};

struct PageLie {
  const char* name;
  std::uint32_t page;
  std::function<void(flash::Page&)> change;
  const char* words;
};

class PageLies : public RawPagesTest, public testing::WithParamInterface<PageLie> {};

TEST_P(PageLies, AreNamedWhereThePageComesInAndEndTheRun) {
  alter_page(GetParam().page, 1000, GetParam().change);
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr(GetParam().words));
  EXPECT_THAT(reason(), HasSubstr("fake0: page "));
  EXPECT_EQ(estimators_.jobs, 0);
  EXPECT_NE(ins_.state(), ins::State::rotating);
  EXPECT_TRUE(old_set_in_force());
}

// As with a wrong CRC: what was spoilt on its way is right when it is fetched again.
TEST_P(PageLies, AreSurvivedWhereThePageIsRightTheNextTime) {
  alter_page(GetParam().page, 2, GetParam().change);
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(run_->progress().pages_refetched, 2u);
}

INSTANTIATE_TEST_SUITE_P(
    Run, PageLies,
    testing::Values(
        PageLie{"hole", 3, [](flash::Page& p) { p.first_sample += 1; }, "page 3: first sample 436, 435 expected"},
        PageLie{"overlap", 3, [](flash::Page& p) { p.first_sample = 2 * full; },
                "page 3: first sample 290, 435 expected"},
        PageLie{"far", 3, [](flash::Page& p) { p.first_sample = ~0ULL; }, "page 3: first sample 18446744073709551615"},
        PageLie{"short", 3, [](flash::Page& p) { p.samples.resize(144); }, "page 3: 144 samples, 145 expected"},
        PageLie{"empty", 3, [](flash::Page& p) { p.samples.clear(); }, "page 3: 0 samples, 145 expected"},
        PageLie{"order", 3, [](flash::Page& p) { p.run_id += 1; }, "page 3: rotation "},
        PageLie{"last", 19, [](flash::Page& p) { p.samples.resize(100); }, "page 19: 100 samples, 145 expected"}),
    [](const auto& tested) { return std::string(tested.param.name); });

// The directory counts 45 samples less than the last page has.
TEST_F(RawPagesTest, TheirTotalIsTheDirectorys) {
  ins_.alter = [](std::span<const std::uint8_t> request, Answer<Bytes>& answer) {
    const Bytes of_directory = uds::read_request(ins::did::raw_data_directory);
    if (answer && std::equal(of_directory.begin(), of_directory.end(), request.begin(), request.end())) {
      ins::DirectoryRecord record = ins::decode_directory(std::span(*answer).subspan(3)).value();
      record.samples -= record.pages_written == FakeIns::pages ? 45 : 0;
      answer = uds::read_response(ins::did::raw_data_directory, ins::encode(record));
    }
  };
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("page 19: 145 samples, 100 expected"));
}

// --- the time that the rotation took ----------------------------------------------------------------------------------

// The rotation of 100 s holds 2900 samples. An INS that says that its rate is 3 % less has 103.1 s of data in 100 s: more
// than an answer's age (1 s) and two quartz clocks (0.1 s) allow, and within what its number of pages may differ.
TEST_F(RawPagesTest, MoreDataThanTheRotationLastedAreRefused) {
  ins_.told_rate_hz = 0.97 * ins_.sample_rate_hz;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("directory: 2900 samples at 28.13 Hz are 103.1 s of data, but the rotation took at "
                                  "most 10"));
  EXPECT_EQ(estimators_.jobs, 0);
}

// 16 s less, which 10 s for the FLASH and 1 s for an answer's age do not explain: a rate 19 % higher.
TEST_F(RawPagesTest, LessDataThanTheRotationLastedAreRefused) {
  ins_.told_rate_hz = 1.19 * ins_.sample_rate_hz;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("are 84.0 s of data, but the rotation took at least 9"));
}

TEST_F(RawPagesTest, ADaemonThatDidNotSeeTheBeginningHasNoUpperBound) {
  ins_.told_rate_hz = 0.97 * ins_.sample_rate_hz;
  begin();
  ASSERT_TRUE(until(State::rotating));
  restart_daemon();
  EXPECT_EQ(end(), State::completed) << reason();
}

TEST(RotationClock, BoundsAreWhatWasSeen) {
  RotationClock clock;
  clock.state_told(false, 1s, 2s);  // before the rotation: of no matter
  clock.start_asked(10s);
  EXPECT_FALSE(clock.time().most_s);
  clock.state_told(true, 12s, 13s);
  clock.state_told(true, 50s, 51s);
  clock.state_told(false, 60s, 61s);
  clock.state_told(false, 70s, 71s);
  EXPECT_DOUBLE_EQ(clock.time().least_s, 37.0);  // from the first answer to the last question
  EXPECT_DOUBLE_EQ(*clock.time().most_s, 51.0);  // from the request to the first answer that it is over
  clock.start_asked(100s);
  EXPECT_EQ(clock.time().least_s, 0.0);
  EXPECT_FALSE(clock.time().most_s);
}

// A virtual INS whose clock stands while the host is busy: less data than its speed promises are no contradiction.
TEST(RotationTime, AVirtualInsMayBeSlow) {
  InsConfig config;
  config.time_scale = 50.0;
  ins::DirectoryRecord directory;
  directory.samples = 2000;
  ins::SampleFormatRecord format;
  format.sample_rate_hz = 1.0;
  EXPECT_FALSE(check_rotation_time(directory, format, {60.0, 61.0}, config));
  EXPECT_TRUE(check_rotation_time(directory, format, {38.0, 38.9}, config));  // 1945 s, and 50 s for the answer
  config.time_scale = 1.0;
  EXPECT_TRUE(check_rotation_time(directory, format, {3000.0, 3001.0}, config));
}

}  // namespace
}  // namespace selfcal
