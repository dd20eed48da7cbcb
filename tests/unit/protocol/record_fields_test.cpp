// The table of record fields against the encoders: bytes read by the table give back what was encoded.
#include "protocol/ins_interface/record_fields.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "protocol/byte_order.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/ins_interface/identifiers.hpp"
#include "protocol/ins_interface/records.hpp"

namespace selfcal::ins {
namespace {

using testing::ElementsAre;

const RecordLayout& layout(std::string_view record) {
  for (const RecordLayout& l : record_layouts()) {
    if (l.name == record) {
      return l;
    }
  }
  throw std::runtime_error("no such record: " + std::string(record));
}

// Every number of a record in the order of its bytes, as the table says where it stands; text and zeros are skipped.
std::vector<double> read_by_table(std::string_view record, ByteView bytes) {
  std::vector<double> found;
  ByteReader in(bytes);
  const auto read = [&](const RecordField& field) {
    for (std::size_t k = 0; k < field.count; ++k) {
      switch (field.type) {
        case FieldType::u8: found.push_back(in.get<std::uint8_t>()); break;
        case FieldType::u16: found.push_back(in.get<std::uint16_t>()); break;
        case FieldType::u32: found.push_back(in.get<std::uint32_t>()); break;
        case FieldType::u64: found.push_back(static_cast<double>(in.get<std::uint64_t>())); break;
        case FieldType::i32: found.push_back(in.get<std::int32_t>()); break;
        case FieldType::i64: found.push_back(static_cast<double>(in.get<std::int64_t>())); break;
        case FieldType::f64: found.push_back(in.get_double()); break;
        case FieldType::text:
        case FieldType::zero: in.get<std::uint8_t>(); break;
      }
    }
  };
  const RecordLayout& l = layout(record);
  std::vector<RecordField> repeated;
  for (const RecordField& field : l.fields) {
    field.repeated ? repeated.push_back(field) : read(field);
  }
  if (!repeated.empty()) {
    for (int k = 0; k < static_cast<int>(found.at(0)); ++k) {
      for (const RecordField& field : repeated) {
        read(field);
      }
    }
  }
  EXPECT_TRUE(in.ok()) << record << " is longer by the table";
  EXPECT_EQ(in.left(), 0U) << record << " is shorter by the table";
  return found;
}

TEST(RecordFields, SayWhereEveryNumberStands) {
  EXPECT_THAT(read_by_table("StateRecord", encode(StateRecord{State::checking, 5, Slot::b, 11, 22, 33, 44})),
              ElementsAre(6, 5, 2, 11, 22, 33, 44));
  EXPECT_THAT(read_by_table("ScheduleRecord", encode(ScheduleRecord{{{1, -2, 3}, {4, 5, 6}}, 7})),
              ElementsAre(2, 7, 1, -2, 3, 4, 5, 6));
  EXPECT_THAT(read_by_table("SiteRecord", encode(SiteRecord{1.5, -2.5, 3.5})), ElementsAre(1.5, -2.5, 3.5));
  EXPECT_THAT(read_by_table("DirectoryRecord", encode(DirectoryRecord{1, 2, 3, 4, 5'000'000'000, true})),
              ElementsAre(1, 2, 3, 4, 5e9, 1));
  EXPECT_THAT(read_by_table("SampleFormatRecord", encode(SampleFormatRecord{200.0, 1e-7, 2e-6, 1e-4, 4096, 145})),
              ElementsAre(200.0, 1e-7, 2e-6, 1e-4, 4096, 145));
  EXPECT_THAT(read_by_table("RunRecord", encode(RunRecord{State::complete, 1, 2, 3, 4})), ElementsAre(3, 1, 2, 3, 4));
  EXPECT_THAT(read_by_table("NavigationCheckRequest", encode(NavigationCheckRequest{600, Slot::a})),
              ElementsAre(600, 1));
  EXPECT_THAT(read_by_table("NavigationCheckRecord", encode(NavigationCheckRecord{true, 1.5, 2.5, -3.5, 4.5})),
              ElementsAre(1, 1.5, 2.5, -3.5, 4.5));
}

TEST(RecordFields, SayWhereTheCoefficientsStand) {
  Coefficients set;
  set.version = 3;
  set.date_s = 1'700'000'000;
  set.author = "selfcald";
  for (std::size_t k = 0; k < coefficient_count; ++k) {
    set.value[k] = 1.0 + static_cast<double>(k);
  }
  const CoefficientsBytes bytes = encode(set);
  std::vector<double> expected = {1, 3, 1.7e9};
  expected.insert(expected.end(), set.value.begin(), set.value.end());
  expected.push_back(stored_crc(bytes));
  EXPECT_EQ(read_by_table("Coefficients", bytes), expected);
}

TEST(RecordFields, DescribeEveryRecordThatTheTableOfIdentifiersNames) {
  for (const DataIdentifier& d : data_identifiers) {
    if (d.content != "ASCII") {
      EXPECT_FALSE(layout(d.content).fields.empty());
    }
  }
}

TEST(RecordFields, AddUpToTheLengthOfTheRecord) {
  std::size_t sum = 0;
  for (const RecordField& field : layout("Coefficients").fields) {
    sum += bytes(field);
  }
  EXPECT_EQ(sum, coefficients_bytes);
}

}  // namespace
}  // namespace selfcal::ins
