// The power goes at any byte that FLASH takes: the INS always comes up with one complete valid set.
#include <gmock/gmock.h>

#include "protocol/flash/page.hpp"
#include "sim_ins/device/stores.hpp"
#include "sim_ins/random.hpp"

namespace selfcal::sim {
namespace {

ins::Coefficients set_of(std::uint32_t version) {
  ins::Coefficients set;
  set.version = version;
  set.author = "test";
  set.value.fill(version * 1e-6);
  return set;
}

// Erase, write, commit, as a calibration does; false where the power went on the way.
bool install(CoefficientStore& store, const ins::Coefficients& set) {
  try {
    store.erase_inactive();
    EXPECT_TRUE(store.write_inactive(set));
    EXPECT_TRUE(store.commit_inactive(ins::stored_crc(ins::encode(set))));
    return true;
  } catch (const PowerLost&) {
    return false;
  }
}

TEST(PowerCut, AThousandRandomInstantsLeaveOneCompleteSet) {
  auto flash = FlashMemory::open("", flash_bytes);
  ASSERT_TRUE(flash);
  CoefficientStore store(*flash);
  store.write_factory_if_blank(set_of(0));
  store.power_on();
  Random random(2026, 1);
  std::uint32_t version = 0;   // of the set that must be in force
  int cuts = 0;
  int installed = 0;
  for (int k = 0; k < 1000; ++k) {
    // An installation takes a block's erasure, a record and the mark; one cut in ten comes after it.
    constexpr double span = 1.1 * (flash_block_bytes + ins::coefficients_bytes + 4);
    flash->lose_power_after(static_cast<std::uint64_t>(random.uniform(0.0, span)));
    const bool whole = install(store, set_of(version + 1));
    flash->lose_power_after(std::nullopt);
    store.power_on();
    cuts += whole ? 0 : 1;
    installed += whole ? 1 : 0;
    version += whole ? 1 : 0;
    ASSERT_EQ(store.in_force(), set_of(version)) << "cut " << k;
    ASSERT_FALSE(store.fell_back() && version > 0) << "cut " << k;
  }
  RecordProperty("cuts", cuts);
  EXPECT_GT(cuts, 800);
  EXPECT_GT(installed, 30);
}

// Every byte of the last and most delicate step, the mark.
TEST(PowerCut, EveryByteOfTheCommit) {
  for (std::uint64_t byte = 0; byte < 4; ++byte) {
    auto flash = FlashMemory::open("", flash_bytes);
    ASSERT_TRUE(flash);
    CoefficientStore store(*flash);
    store.write_factory_if_blank(set_of(0));
    store.power_on();
    ASSERT_TRUE(install(store, set_of(1)));
    store.power_on();
    store.erase_inactive();
    ASSERT_TRUE(store.write_inactive(set_of(2)));
    flash->lose_power_after(byte);
    EXPECT_THROW((void)store.commit_inactive(ins::stored_crc(ins::encode(set_of(2)))), PowerLost);
    flash->lose_power_after(std::nullopt);
    store.power_on();
    EXPECT_EQ(store.in_force(), set_of(1)) << byte;
  }
}

TEST(PowerCut, CountersNeverGoBackByMoreThanTheOneUnderWay) {
  auto flash = FlashMemory::open("", flash_bytes);
  ASSERT_TRUE(flash);
  CounterStore counters(*flash);
  counters.power_on();
  Random random(7, 1);
  std::uint32_t kept = 0;
  for (int k = 0; k < 500; ++k) {
    flash->lose_power_after(static_cast<std::uint64_t>(random.uniform(0.0, 1.2 * flash_block_bytes)));
    bool whole = true;
    try {
      counters.set(kept + 1, 3);
    } catch (const PowerLost&) {
      whole = false;
    }
    flash->lose_power_after(std::nullopt);
    counters.power_on();
    kept += whole ? 1 : 0;
    ASSERT_EQ(counters.get().power_cycles, kept) << k;
  }
}

flash::Page page_of(std::uint32_t run_id, std::uint32_t sequence) {
  flash::Page page;
  page.run_id = run_id;
  page.sequence = sequence;
  page.samples.resize(flash::samples_per_page);
  return page;
}

// A tester that lost its records may use a run's number again.
TEST(PowerCut, PagesOfAnEarlierRunOfTheSameNumberDoNotCount) {
  for (const std::uint32_t written : {0U, 1U, 2U}) {
    auto flash = FlashMemory::open("", flash_bytes);
    ASSERT_TRUE(flash);
    RawStore raw(*flash);
    raw.begin(7, 100);
    for (std::uint32_t k = 0; k < 5; ++k) {
      raw.append(page_of(7, k));
    }
    raw.begin(7, 100);
    for (std::uint32_t k = 0; k < written; ++k) {
      raw.append(page_of(7, k));
    }
    raw.power_on();
    EXPECT_EQ(raw.pages_written(), written);
  }
}

TEST(PowerCut, ATornPageIsNotOneOfTheRun) {
  auto flash = FlashMemory::open("", flash_bytes);
  ASSERT_TRUE(flash);
  RawStore raw(*flash);
  raw.begin(42, 100);
  raw.append(page_of(42, 0));
  flash->lose_power_after(flash_block_bytes + 2000);   // within the second page's bytes
  EXPECT_THROW(raw.append(page_of(42, 1)), PowerLost);
  flash->lose_power_after(std::nullopt);
  raw.power_on();
  EXPECT_EQ(raw.pages_written(), 1U);
  EXPECT_EQ(raw.directory().run_id, 42U);
  EXPECT_TRUE(raw.directory().complete);
}

}  // namespace
}  // namespace selfcal::sim
