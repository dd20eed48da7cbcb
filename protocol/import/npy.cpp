// NumPy's .npy, format versions 1 to 3: numpy/lib/format.py ("NEP 1").
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>

#include "protocol/import/array_source.hpp"

namespace selfcal::import {
namespace {

struct Field {
  std::string name;
  NumberType type = NumberType::f8;
  bool big_endian = false;
  bool number = true;  // text, objects and the like are passed over
  std::size_t size = 8;
  std::size_t count = 1;
};

// The header: a Python dictionary of three known keys.
class HeaderReader {
 public:
  explicit HeaderReader(std::string_view text) : text_(text) {}

  bool read() {
    if (!take('{')) {
      return false;
    }
    while (!take('}')) {
      const std::string key = quoted();
      if (!take(':')) {
        return false;
      }
      const bool good = key == "descr"           ? read_descr()
                        : key == "fortran_order" ? read_order()
                                                 : key == "shape" && read_shape();
      if (!good) {
        return false;
      }
      take(',');
    }
    return !fields.empty();
  }

  std::vector<Field> fields;
  std::vector<std::size_t> shape;
  bool fortran_order = false;

 private:
  void skip() {
    while (!text_.empty() && (text_.front() == ' ' || text_.front() == '\n')) {
      text_.remove_prefix(1);
    }
  }
  bool take(char c) {
    skip();
    const bool there = text_.starts_with(c);
    text_.remove_prefix(there ? 1 : 0);
    return there;
  }
  std::string quoted() {
    skip();
    const char mark = text_.starts_with('"') ? '"' : '\'';
    const std::size_t end = text_.starts_with(mark) ? text_.find(mark, 1) : std::string_view::npos;
    if (end == std::string_view::npos) {
      return {};
    }
    std::string word(text_.substr(1, end - 1));
    text_.remove_prefix(end + 1);
    return word;
  }
  bool read_shape() {
    if (!take('(')) {
      return false;
    }
    while (!take(')')) {
      skip();
      std::size_t value = 0;
      const auto [stop, error] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
      if (error != std::errc{}) {
        return false;
      }
      text_.remove_prefix(static_cast<std::size_t>(stop - text_.data()));
      shape.push_back(value);
      take(',');
    }
    return true;
  }
  bool read_order() {
    skip();
    fortran_order = text_.starts_with("True");
    const std::size_t length = fortran_order ? 4 : 5;
    const bool good = fortran_order || text_.starts_with("False");
    text_.remove_prefix(std::min(length, text_.size()));
    return good;
  }
  // '<f8', or [('t', '<f8'), ('gyro', '<f4', (3,))].
  bool read_descr() {
    if (!take('[')) {
      return add_field({}, quoted());
    }
    while (!take(']')) {
      if (!take('(')) {
        return false;
      }
      const std::string name = quoted();
      if (!take(',') || !add_field(name, quoted())) {
        return false;
      }
      take(',');
      if (text_.starts_with('(') || text_.starts_with(" (")) {
        const std::vector<std::size_t> outer = std::exchange(shape, {});
        if (!read_shape()) {
          return false;
        }
        for (const std::size_t n : std::exchange(shape, outer)) {
          fields.back().count *= n;
        }
      }
      if (!take(')')) {
        return false;
      }
      take(',');
    }
    return true;
  }
  bool add_field(std::string name, std::string_view type) {
    Field field;
    field.name = std::move(name);
    if (type.size() < 3) {
      return false;
    }
    field.big_endian = type.front() == '>';
    const std::string_view digits =
        type.substr(2, type.find('[') == std::string_view::npos ? std::string_view::npos : type.find('[') - 2);
    const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), field.size);
    if (error != std::errc{} || stop != digits.data() + digits.size() || field.size == 0 || field.size > 1'000'000) {
      return false;
    }
    const char kind = type[1];
    field.size *= kind == 'U' ? 4 : 1;
    static constexpr std::array<std::pair<std::string_view, NumberType>, 10> known{{{"f4", NumberType::f4},
                                                                                    {"f8", NumberType::f8},
                                                                                    {"i1", NumberType::i1},
                                                                                    {"i2", NumberType::i2},
                                                                                    {"i4", NumberType::i4},
                                                                                    {"i8", NumberType::i8},
                                                                                    {"u1", NumberType::u1},
                                                                                    {"u2", NumberType::u2},
                                                                                    {"u4", NumberType::u4},
                                                                                    {"u8", NumberType::u8}}};
    // Dates ('M8[ns]') are counts of their unit: whole numbers like any other.
    const std::string wanted = fmt::format("{}{}", kind == 'M' ? 'i' : kind == 'b' ? 'u' : kind, digits);
    const auto found = std::find_if(known.begin(), known.end(), [&](const auto& k) { return k.first == wanted; });
    field.number = found != known.end();
    field.type = field.number ? found->second : NumberType::u1;
    fields.push_back(std::move(field));
    return true;
  }

  std::string_view text_;
};

// Bytes before the samples, and the header's text; nothing where the image is none.
std::optional<std::pair<std::size_t, std::string_view>> header_of(std::string_view image) {
  constexpr std::string_view magic = "\x93NUMPY";
  constexpr std::size_t before_length = 8;
  if (!image.starts_with(magic) || image.size() < before_length + 4) {
    return std::nullopt;
  }
  const auto byte = [&](std::size_t k) { return static_cast<std::size_t>(static_cast<unsigned char>(image[k])); };
  const bool old = image[6] == 1;
  const std::size_t length =
      old ? byte(8) | byte(9) << 8U : byte(8) | byte(9) << 8U | byte(10) << 16U | byte(11) << 24U;
  const std::size_t begin = before_length + (old ? 2 : 4);
  if (length > image.size() - begin) {
    return std::nullopt;
  }
  return std::pair{begin + length, image.substr(begin, length)};
}

}  // namespace

Expected<void> add_npy(std::string image, const std::string& name, const std::string& file, Arrays& arrays) {
  const auto bad = [&](std::string_view what) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}{}{}", file, name, name.empty() ? "" : ": ", what));
  };
  const auto header = header_of(image);
  if (!header) {
    return bad("is no .npy array, or cut off");
  }
  HeaderReader reader(header->second);
  if (!reader.read() || reader.shape.size() > 2) {
    return bad("holds no array of one or two dimensions of numbers");
  }
  std::size_t item = 0;
  for (const Field& field : reader.fields) {
    item += field.size * field.count;
  }
  const std::size_t rows = reader.shape.empty() ? 1 : reader.shape[0];
  const std::size_t columns = reader.shape.size() < 2 ? 1 : reader.shape[1];
  const std::size_t bytes = image.size() - header->first;
  // In this order nothing overflows.
  if (rows > 0 && columns > 0 && (item > bytes || rows > bytes / item || columns > bytes / item / rows)) {
    return bad(fmt::format("{} bytes; {} x {} numbers of {} bytes are announced", bytes, rows, columns, item));
  }
  const std::size_t block = arrays.blocks.size();
  if (reader.fields.size() == 1 && reader.fields[0].name.empty()) {
    const Field& field = reader.fields[0];
    if (!field.number || reader.shape.empty()) {
      return {};
    }
    add_array(name, field.type, field.big_endian, {rows, columns, reader.fortran_order}, block, header->first, arrays);
  } else {
    std::size_t offset = header->first;
    for (const Field& field : reader.fields) {
      for (std::size_t k = 0; k < field.count && k < 64; ++k) {
        const std::string part = field.count == 1   ? ""
                                 : field.count == 3 ? fmt::format(".{}", "xyz"[k])
                                                    : fmt::format(".{}", k + 1);
        if (field.number) {
          arrays.columns.push_back(
              {field.name + part, field.type, field.big_endian, block, offset + k * field.size, item, rows * columns});
        }
      }
      offset += field.size * field.count;
    }
  }
  arrays.blocks.push_back(std::move(image));
  return {};
}

}  // namespace selfcal::import
