// The power goes at any byte that FLASH takes: the INS always comes up with one complete valid set.
#include <gmock/gmock.h>

#include <cstdio>

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
    EXPECT_EQ(store.inactive_crc(), ins::stored_crc(ins::encode(set)));
    store.commit_inactive();
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
  std::uint32_t version = 0;  // of the set that must be in force
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
    EXPECT_THROW(store.commit_inactive(), PowerLost);
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

// 98 minutes at 200 Hz fill the ring. A longer run loses its oldest pages and nothing else, and what is left outlives a
// power cut wherever the ring's end lies, also in the erasure ahead of the newest page and in that page itself.
TEST(PowerCut, ARunLongerThanTheRingKeepsItsNewestPages) {
  constexpr auto ring = static_cast<std::uint32_t>(raw_ring_pages);
  auto flash = FlashMemory::open("", flash_bytes);
  ASSERT_TRUE(flash);
  RawStore raw(*flash);
  raw.begin(7, 3 * ring);
  const auto append = [&](std::uint32_t sequence) {
    raw.append(page_of(7, sequence));
    flash->advance(flash->ready_at_s());
  };
  std::uint32_t next = 0;
  for (const std::uint32_t written : {ring - 1, ring, ring + 100}) {
    while (next < written) {
      append(next++);
    }
    RawStore after(*flash);
    after.power_on();
    EXPECT_EQ(after.directory(), (ins::DirectoryRecord{7, written < ring ? 0 : written + 1 - ring, written, 3 * ring,
                                                       std::uint64_t{written} * flash::samples_per_page, true}));
    EXPECT_EQ(after.first_page(), raw.first_page());
    flash::Page page;
    for (const std::uint32_t sequence : {after.first_page(), written - 1}) {
      ASSERT_TRUE(flash::decode_page(after.page(sequence), page));
      EXPECT_EQ(page.sequence, sequence);
    }
    // The next page's write is cut in the erasure ahead of it, then in the page.
    for (const std::uint64_t bytes : {std::uint64_t{100}, std::uint64_t{flash_block_bytes + 2000}}) {
      auto copy = FlashMemory::open("", flash_bytes);
      ASSERT_TRUE(copy);
      for (std::size_t at = 0; at < flash_bytes; at += flash_block_bytes) {
        copy->program(at, flash->read(at, flash_block_bytes));
      }
      RawStore torn(*copy);
      torn.power_on();
      copy->lose_power_after(bytes);
      EXPECT_THROW(torn.append(page_of(7, written)), PowerLost);
      copy->lose_power_after(std::nullopt);
      torn.power_on();
      EXPECT_EQ(torn.pages_written(), written);
      EXPECT_EQ(torn.first_page(), written + 2 > ring ? written + 2 - ring : 0U) << written;
    }
  }
}

// The same number, an earlier run that went round the ring: nothing of it counts.
TEST(PowerCut, PagesOfAnEarlierRunThatWentRoundDoNotCount) {
  auto flash = FlashMemory::open("", flash_bytes);
  ASSERT_TRUE(flash);
  RawStore raw(*flash);
  raw.begin(7, 10000);
  for (std::uint32_t k = 0; k < raw_ring_pages + 50; ++k) {
    raw.append(page_of(7, k));
    flash->advance(flash->ready_at_s());
  }
  raw.begin(7, 10000);
  for (std::uint32_t k = 0; k < 3; ++k) {
    raw.power_on();
    EXPECT_EQ(raw.directory(), (ins::DirectoryRecord{7, 0, k, 10000, k * flash::samples_per_page, true}));
    raw.append(page_of(7, k));
  }
}

// A write that the power cuts in time stays half done: the erasure by as much as was done of it, the record not begun.
TEST(PowerCut, TheClockSaysHowFarAWriteCame) {
  auto flash = FlashMemory::open("", 2 * flash_block_bytes);
  ASSERT_TRUE(flash);
  const std::vector<std::uint8_t> zeros(flash_block_bytes, 0);
  flash->program(0, zeros);
  flash->advance(1.0);  // 16 writes of 0.8 ms are over
  EXPECT_FALSE(flash->busy());
  flash->erase(0);
  flash->program(0, std::array<std::uint8_t, 2>{0x12, 0x34});
  EXPECT_DOUBLE_EQ(flash->ready_at_s(), 1.0 + 0.045 + 0.0008);
  EXPECT_EQ(flash->read(0, 1)[0], 0x12);  // what the INS has in RAM
  flash->cut_power(1.0 + 0.045 / 4.0);
  EXPECT_EQ(flash->read(0, 1)[0], 0xFF);
  EXPECT_EQ(flash->read(1023, 1)[0], 0xFF);
  EXPECT_EQ(flash->read(1024, 1)[0], 0x00);
  EXPECT_FALSE(flash->busy());
}

// Another process that opens the file finds what the chip had done, and erased bytes where nothing was ever written.
TEST(PowerCut, TheFileHoldsWhatTheChipHadDone) {
  const std::string path = testing::TempDir() + "flash_memory_test.bin";
  std::remove(path.c_str());
  constexpr std::size_t bytes = 8 * flash_block_bytes;
  {
    auto flash = FlashMemory::open(path, bytes);
    ASSERT_TRUE(flash);
    flash->program(5 * flash_block_bytes, std::array<std::uint8_t, 3>{1, 2, 3});
    flash->program(100, std::array<std::uint8_t, 2>{4, 5});
    flash->erase(7);
    flash->advance(1.0);
    flash->erase(5);
    flash->advance(1.0 + 0.045 / 4096.0 * 1.5);  // one byte of it
  }
  auto again = FlashMemory::open(path, bytes);
  ASSERT_TRUE(again);
  std::vector<std::uint8_t> expected(bytes, 0xFF);
  expected[100] = 4;
  expected[101] = 5;
  expected[5 * flash_block_bytes + 1] = 2;
  expected[5 * flash_block_bytes + 2] = 3;
  for (std::size_t at = 0; at < bytes; at += flash_block_bytes) {
    EXPECT_THAT(again->read(at, flash_block_bytes),
                testing::ElementsAreArray(std::span(expected).subspan(at, flash_block_bytes)));
  }
  std::remove(path.c_str());
}

TEST(PowerCut, ATornPageIsNotOneOfTheRun) {
  auto flash = FlashMemory::open("", flash_bytes);
  ASSERT_TRUE(flash);
  RawStore raw(*flash);
  raw.begin(42, 100);
  raw.append(page_of(42, 0));
  flash->lose_power_after(flash_block_bytes + 2000);  // within the second page's bytes
  EXPECT_THROW(raw.append(page_of(42, 1)), PowerLost);
  flash->lose_power_after(std::nullopt);
  raw.power_on();
  EXPECT_EQ(raw.pages_written(), 1U);
  EXPECT_EQ(raw.directory().run_id, 42U);
  EXPECT_TRUE(raw.directory().complete);
}

}  // namespace
}  // namespace selfcal::sim
