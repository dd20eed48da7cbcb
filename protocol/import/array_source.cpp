#include "protocol/import/array_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

namespace selfcal::import {
namespace {

constexpr std::size_t most_side_by_side =
    64;  // an array with more columns than that lies on its side, if it has few rows

template <typename Number>
long double number_at(const char* at, bool swap) {
  std::array<char, sizeof(Number)> bytes{};
  std::memcpy(bytes.data(), at, bytes.size());
  if (swap) {
    std::reverse(bytes.begin(), bytes.end());
  }
  return static_cast<long double>(std::bit_cast<Number>(bytes));
}

long double value_at(const RawColumn& column, const char* at) {
  const bool swap = column.big_endian == (std::endian::native == std::endian::little);
  switch (column.type) {
    case NumberType::f4: return number_at<float>(at, swap);
    case NumberType::f8: return number_at<double>(at, swap);
    case NumberType::i1: return number_at<std::int8_t>(at, swap);
    case NumberType::i2: return number_at<std::int16_t>(at, swap);
    case NumberType::i4: return number_at<std::int32_t>(at, swap);
    case NumberType::i8: return number_at<std::int64_t>(at, swap);
    case NumberType::u1: return number_at<std::uint8_t>(at, swap);
    case NumberType::u2: return number_at<std::uint16_t>(at, swap);
    case NumberType::u4: return number_at<std::uint32_t>(at, swap);
    case NumberType::u8: return number_at<std::uint64_t>(at, swap);
  }
  return 0.0L;
}

class ArraySource final : public ColumnSource {
 public:
  ArraySource(Arrays arrays, std::string file) : arrays_(std::move(arrays)), file_(std::move(file)) {
    for (const RawColumn& column : arrays_.columns) {
      names_.push_back(column.name);
    }
  }
  const std::vector<std::string>& names() const override { return names_; }
  const std::vector<std::string>& units() const override { return units_; }
  std::string form() const override { return arrays_.form; }

  Expected<ColumnData> read(const ColumnRequest& request) const override {
    ColumnData data;
    data.rows = arrays_.columns.front().rows;
    if (data.rows > request.most_rows) {
      if (!request.tolerant) {
        return fail(ErrorKind::bad_input,
                    fmt::format("{}: {} rows, at most {} are allowed", file_, data.rows, request.most_rows));
      }
      data.rows = request.most_rows;
      data.left_out = true;
    }
    for (const std::size_t column : request.columns) {
      std::vector<double>& values = data.values.emplace_back(data.rows);
      for (std::size_t row = 0; row < data.rows; ++row) {
        values[row] = static_cast<double>(value(column, row));
        if (!request.tolerant && !std::isfinite(values[row])) {
          return fail(ErrorKind::bad_input, fmt::format("{}: row {}: {}: {}; a finite number is expected", file_, row,
                                                        title(column), values[row]));
        }
      }
    }
    if (request.stamp) {
      if (request.stamp_is_date) {
        return fail(ErrorKind::bad_input,
                    fmt::format("{}: {}: numbers; dates are expected", file_, title(*request.stamp)));
      }
      data.stamps.resize(data.rows);
      for (std::size_t row = 0; row < data.rows; ++row) {
        data.stamps[row] = value(*request.stamp, row);
      }
    }
    return data;
  }

 private:
  long double value(std::size_t column, std::size_t row) const {
    const RawColumn& raw = arrays_.columns[column];
    return value_at(raw, arrays_.blocks[raw.block].data() + raw.offset + row * raw.stride);
  }

  Arrays arrays_;
  std::string file_;
  std::vector<std::string> names_;
  std::vector<std::string> units_;
};

}  // namespace

std::size_t size_of(NumberType type) {
  switch (type) {
    case NumberType::i1:
    case NumberType::u1: return 1;
    case NumberType::i2:
    case NumberType::u2: return 2;
    case NumberType::f4:
    case NumberType::i4:
    case NumberType::u4: return 4;
    default: return 8;
  }
}

void add_array(const std::string& name, NumberType type, bool big_endian, const ArrayShape& shape, std::size_t block,
               std::size_t offset, Arrays& arrays) {
  const std::size_t size = size_of(type);
  std::size_t row_stride = shape.column_major ? size : size * shape.columns;
  std::size_t column_stride = shape.column_major ? size * shape.rows : size;
  std::size_t rows = shape.rows;
  std::size_t columns = shape.columns;
  if (columns > most_side_by_side && rows <= most_side_by_side) {
    std::swap(rows, columns);
    std::swap(row_stride, column_stride);
  }
  if (columns > most_side_by_side) {
    return;  // a picture, a matrix: no columns of samples
  }
  for (std::size_t k = 0; k < columns; ++k) {
    RawColumn column;
    const std::string part = columns == 3 ? std::string(1, "xyz"[k]) : fmt::format("{}", k + 1);
    column.name = columns == 1 ? name : name.empty() ? std::string() : fmt::format("{}.{}", name, part);
    column.type = type;
    column.big_endian = big_endian;
    column.block = block;
    column.offset = offset + k * column_stride;
    column.stride = row_stride;
    column.rows = rows;
    arrays.columns.push_back(std::move(column));
  }
}

namespace {

void put_number(std::string& out, std::uint64_t number) {
  out.append(reinterpret_cast<const char*>(&number), sizeof number);
}

}  // namespace

void put_array(std::string& out, const std::string& name, NumberType type, const ArrayShape& shape,
               std::string_view bytes) {
  put_number(out, name.size());
  out += name;
  put_number(out, static_cast<std::uint64_t>(type));
  put_number(out, shape.rows);
  put_number(out, shape.columns);
  put_number(out, shape.column_major ? 1 : 0);
  out += bytes;
}

void add_arrays(std::string written, Arrays& arrays) {
  const std::string& block = arrays.blocks.emplace_back(std::move(written));
  const std::size_t number_of_block = arrays.blocks.size() - 1;
  std::size_t at = 0;
  const auto take = [&] {
    std::uint64_t number = 0;
    std::memcpy(&number, block.data() + at, sizeof number);
    at += sizeof number;
    return static_cast<std::size_t>(number);
  };
  // Our own child wrote it: no checks.
  while (at < block.size()) {
    const std::size_t length = take();
    const std::string name = block.substr(at, length);
    at += length;
    const auto type = static_cast<NumberType>(take());
    const std::size_t rows = take(), columns = take();
    const bool column_major = take() != 0;
    add_array(name, type, std::endian::native == std::endian::big, {rows, columns, column_major}, number_of_block, at,
              arrays);
    at += rows * columns * size_of(type);
  }
}

Expected<std::unique_ptr<ColumnSource>> array_source(Arrays arrays, const std::string& file) {
  std::map<std::size_t, std::size_t> lengths;
  for (const RawColumn& column : arrays.columns) {
    ++lengths[column.rows];
  }
  std::size_t rows = 0;
  std::size_t most = 0;
  for (const auto& [length, columns] : lengths) {
    if (length > 1 && columns >= most) {
      rows = length;
      most = columns;
    }
  }
  // One column alone is one sensor's, if it is long: nothing but scalars may stand beside it.
  constexpr std::size_t long_enough = 100;
  if (most < 2 && (most == 0 || rows < long_enough || lengths.size() > (lengths.contains(1) ? 2U : 1U))) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}: holds no two columns of numbers of one length", file, arrays.form));
  }
  std::string left_out;
  for (const RawColumn& column : arrays.columns) {
    if (column.rows != rows) {
      left_out += fmt::format("{}{} ({})", left_out.empty() ? "" : ", ", column.name, column.rows);
    }
  }
  std::erase_if(arrays.columns, [rows](const RawColumn& column) { return column.rows != rows; });
  arrays.form += fmt::format(", {} columns of {}{}{}", most, rows,
                             left_out.empty() ? "" : "; left out for their length: ", left_out);
  return std::make_unique<ArraySource>(std::move(arrays), file);
}

}  // namespace selfcal::import
