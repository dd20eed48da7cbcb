#include "protocol/profile/read_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "protocol/profile/coefficient_fields.hpp"
#include "protocol/profile/frames.hpp"
#include "protocol/toml_file/nearest_word.hpp"

namespace selfcal::profile {
namespace {

constexpr std::size_t longest_record = 65536;
constexpr std::uint64_t most_positions = 255;  // of a record whose length is open
constexpr std::array<std::string_view, 2> orders{"big", "little"};

const RoleField* find_role(const RecordRole& role, std::string_view name) {
  const auto found = std::ranges::find(role.fields, name, &RoleField::name);
  return found == role.fields.end() ? nullptr : &*found;
}

std::vector<std::string_view> type_names() {
  std::vector<std::string_view> names;
  for (const FieldType& type : field_types()) {
    names.push_back(type.name);
  }
  return names;
}

void read_type(Section& section, ByteOrder order, std::size_t longest_text, Field& field) {
  const auto names = type_names();
  const auto name = section.word("type", names, true);
  if (name) {
    field.type = *std::ranges::find(field_types(), *name, &FieldType::name);
  }
  const bool text = field.type.kind == Kind::text;
  if (const auto length = section.whole("length", 1, longest_text, text && name.has_value())) {
    if (text) {
      field.type.bytes = *length;
    } else {
      section.fault("length", fmt::format("only ascii has one, not {}", field.type.name));
    }
  }
  field.order = order;
  if (const auto word = section.word("byte_order", orders)) {
    field.order = *word == "little" ? ByteOrder::little : ByteOrder::big;
  }
}

// Part of an unsigned integer.
void read_bits(Section& section, Field& field) {
  const auto first = section.whole("first_bit", 0, 63);
  const auto bits = section.whole("bits", 1, 63, first.has_value());
  if (!bits) {
    return;
  }
  field.first_bit = static_cast<unsigned>(first.value_or(0));
  field.bits = static_cast<unsigned>(*bits);
  if (field.type.kind != Kind::unsigned_integer) {
    section.fault("bits", fmt::format("only u8 to u64 have some, not {}", field.type.name));
  } else if (field.first_bit + field.bits > 8 * field.type.bytes) {
    section.fault("bits", fmt::format("bits {} to {} are not in {}", field.first_bit, field.first_bit + field.bits - 1,
                                      field.type.name));
  }
}

std::uint64_t largest_code(const Field& field) {
  const unsigned bits = field.bits > 0 ? field.bits : static_cast<unsigned>(8 * field.type.bytes);
  const unsigned usable = field.type.kind == Kind::signed_integer ? bits - 1 : bits;
  return usable >= 63 ? (std::uint64_t{1} << 63U) - 1 : (std::uint64_t{1} << usable) - 1;
}

void read_codes(Section& section, const RoleField& role, Field& field) {
  Section codes = section.table("codes", true);
  std::map<std::uint64_t, std::string> taken;
  for (std::size_t k = 0; k < role.words.size(); ++k) {
    const std::string_view word = role.words[k];
    const auto code = codes.whole(word, 0, largest_code(field), codes.there() && word != "checking");
    if (!code) {
      continue;
    }
    if (const auto [other, fresh] = taken.emplace(*code, word); !fresh) {
      codes.fault(word, fmt::format("{} is the code of {} already", *code, other->second));
    }
    field.codes.emplace(k, *code);
  }
  codes.only_these();
}

// The field tells nominal * (1 + value), of K- nominal * (1 - value): its number is of any unit.
void read_nominal(Section& section, const RoleField& role, Field& field) {
  const Factor kind = factor_of(role.name);
  const auto nominal = section.number("nominal", -1e30, 1e30);
  if (!nominal) {
    return;
  }
  if (kind == Factor::none) {
    return section.fault("nominal", fmt::format("{} is no scale factor", role.name));
  }
  if (section.has("unit")) {
    section.fault("unit", "the number has the unit of nominal: leave it out");
  }
  if (*nominal == 0.0) {
    return section.fault("nominal", "is 0");
  }
  const double sign = kind == Factor::negative_slope ? -1.0 : 1.0;
  field.nominal = *nominal;
  field.scale = sign * field.scale / *nominal;
  field.offset = sign * (field.offset / *nominal - 1.0);
}

void read_value(Section& section, const RoleField& role, Field& field) {
  const auto scale = section.number("scale", -1e30, 1e30);
  const auto offset = section.number("offset", -1e30, 1e30);
  if (scale == 0.0) {
    section.fault("scale", "is 0");
  }
  double factor = 1.0;
  if (const auto name = section.text("unit")) {
    field.unit = *name;
    const Unit* given = find_unit(*name);
    const Unit* wanted = find_unit(role.unit);
    std::vector<std::string_view> known;
    for (const Unit& unit : units()) {
      if (unit.quantity == wanted->quantity && !unit.name.empty()) {
        known.push_back(unit.name);
      }
    }
    if (given == nullptr || given->quantity != wanted->quantity) {
      section.fault("unit",
                    fmt::format("no unit of {}: {}{}; known are {}", wanted->quantity, *name,
                                did_you_mean(*name, std::span<const std::string_view>(known)), fmt::join(known, ", ")));
    } else {
      factor = given == wanted ? 1.0 : given->si / wanted->si;
    }
  }
  field.scale = scale.value_or(1.0) * factor;
  field.offset = offset.value_or(0.0) * factor;
  read_nominal(section, role, field);
}

bool check_constant(Section& section, const Field& field, double value) {
  if (field.type.kind == Kind::floating) {
    return true;
  }
  const bool fits = value == std::floor(value) && (value >= 0 || field.type.kind == Kind::signed_integer) &&
                    std::abs(value) <= static_cast<double>(largest_code(field));
  if (!fits) {
    section.fault("constant", fmt::format("{} does not fit {}", value, field.type.name));
  }
  return fits;
}

// Of a field that is a record of its own: an identifier, or an address.
void read_identifier_of(Section& section, Field& field) {
  if (section.has("memory") && section.has(by_did)) {
    section.fault("memory", fmt::format("and did (line {}): a field is told in one way", section.line_of(by_did)));
  } else if (!section.has("memory") && !section.has(by_did)) {
    section.fault(by_did, "missing, and there is no memory in its place");
  }
  if (const auto did = section.whole(by_did, 1, 0xFFFF)) {
    field.did = static_cast<std::uint16_t>(*did);
  }
  if (const auto address = section.whole("memory", 0, 0xFFFFFFFF)) {
    field.memory = static_cast<std::uint32_t>(*address);
  }
}

void read_field(Section& section, const RoleField* role, ByteOrder order, std::string_view numbered_by, Field& field) {
  field.line = section.line();
  field.meaning = role == nullptr ? std::string_view() : role->meaning;
  if (numbered_by == by_did) {
    read_identifier_of(section, field);
  } else if (numbered_by == by_index) {
    if (const auto index = section.whole(by_index, 0, 0xFF, true)) {
      field.did = static_cast<std::uint16_t>(first_index_did + *index);
    }
  } else {
    field.at = section.whole("at", 0, longest_record - 1, true).value_or(0);
  }
  read_type(section, order, 255, field);
  read_bits(section, field);
  field.count = section.whole("count", 1, 64).value_or(1);
  if (field.bits > 0 && field.count != 1) {
    section.fault("count", "a field of bits is one element");
  }
  if (const auto constant = section.number("constant", -1.8e19, 1.8e19, role == nullptr)) {
    if (role != nullptr && role->needed) {
      section.fault("constant", fmt::format("{} tells something: a constant does not", role->name));
    } else if (field.type.kind == Kind::text) {
      section.fault("constant", "ascii has none");
    } else if (check_constant(section, field, *constant)) {
      field.constant = static_cast<long double>(*constant);
    }
  }
  if (role != nullptr && !field.constant) {
    if (role->text != (field.type.kind == Kind::text)) {
      section.fault("type", fmt::format("{} is {}", role->name, role->text ? "text: ascii" : "a number, not text"));
    }
    if (field.count != role->count) {
      section.fault(section.has("count") ? "count" : "",
                    fmt::format("{} has {} elements, not {}", role->name, role->count, field.count));
    }
    role->words.empty() ? read_value(section, *role, field) : read_codes(section, *role, field);
  }
  section.only_these();
}

// Bytes of a record, or some bits of an integer in it.
struct Extent {
  std::string_view name;
  std::size_t line, begin, end;
  const Field* field = nullptr;  // none: repetitions
};

Extent extent_of(const Field& field) { return {field.name, field.line, field.at, field.end(), &field}; }

// Two parts of the same integer may share bytes, and not bits.
bool overlap(const Extent& a, const Extent& b) {
  if (a.begin >= b.end || b.begin >= a.end) {
    return false;
  }
  const bool same_integer = a.field != nullptr && b.field != nullptr && a.field->bits > 0 && b.field->bits > 0 &&
                            a.begin == b.begin && a.end == b.end && a.field->order == b.field->order;
  return !same_integer || (a.field->first_bit < b.field->first_bit + b.field->bits &&
                           b.field->first_bit < a.field->first_bit + a.field->bits);
}

void check_extents(Section& section, std::string_view prefix, const std::vector<Extent>& extents, std::size_t bytes) {
  const auto key_of = [&](const Extent& extent) {
    const bool plain = extent.field == nullptr || extent.name == "checksum";
    return section.path_of(plain ? std::string(extent.name) : fmt::format("{}{}", prefix, extent.name));
  };
  for (std::size_t k = 0; k < extents.size(); ++k) {
    const Extent& extent = extents[k];
    if (extent.end > bytes && extent.field != nullptr) {
      section.faults().add(extent.line, key_of(extent),
                           fmt::format("bytes {} to {} of {}", extent.begin, extent.end - 1, bytes));
    }
    for (std::size_t i = 0; i < k; ++i) {
      const Extent& other = extents[i];
      if (overlap(extent, other)) {
        // Told at both, for nobody knows which of them is wrong.
        const auto words = [](const Extent& with) {
          return fmt::format("overlaps {} (line {}), bytes {} to {}", with.name, with.line, with.begin, with.end - 1);
        };
        section.faults().add(extent.line, key_of(extent), words(other));
        section.faults().add(other.line, key_of(other), words(extent));
      }
    }
  }
}

void read_fields_of(Section& section, const RecordRole& role, bool repeated, ByteOrder order,
                    std::string_view numbered_by, std::vector<Field>& fields) {
  std::size_t next = 0;
  for (const std::string& name : section.keys()) {
    const RoleField* known = find_role(role, name);
    Section table = section.table(name);
    if (!table.there()) {
      continue;
    }
    if (known != nullptr && known->repeated != repeated) {
      table.fault("", repeated ? "is not repeated: it belongs to fields" : "is repeated: it belongs to each.fields");
    }
    if (known == nullptr && !table.has("constant")) {
      std::vector<std::string_view> names;
      for (const RoleField& field : role.fields) {
        if (field.repeated == repeated) {
          names.push_back(field.name);
        }
      }
      table.fault("",
                  fmt::format("no such field{}; known are {}, and any name with a constant",
                              did_you_mean(name, std::span<const std::string_view>(names)), fmt::join(names, ", ")));
    }
    Field field;
    field.name = name;
    read_field(table, known, order, numbered_by, field);
    if (!numbered_by.empty()) {
      field.at = std::exchange(next, next + field.type.bytes * field.count);
    }
    fields.push_back(std::move(field));
  }
}

void read_repetition(Section& section, const RecordRole& role, ByteOrder order, Layout& layout) {
  if (!section.there()) {
    return;
  }
  Layout::Repetition each;
  each.at = section.whole("at", 0, longest_record - 1, true).value_or(0);
  each.stride = section.whole("stride", 1, longest_record, true).value_or(1);
  const std::size_t room = layout.bytes > each.at ? (layout.bytes - each.at) / each.stride : 0;
  each.most = section.whole("most", 1, 1024).value_or(layout.bytes == 0 ? most_positions : room);
  each.count = section.text("count", true).value_or("");
  if (!each.count.empty() && std::ranges::find(layout.fields, each.count, &Field::name) == layout.fields.end()) {
    section.fault("count", fmt::format("no such field: {}", each.count));
  }
  Section fields = section.table("fields", true);
  read_fields_of(fields, role, true, order, {}, each.fields);
  std::vector<Extent> extents;
  for (const Field& field : each.fields) {
    extents.push_back(extent_of(field));
  }
  check_extents(fields, "", extents, each.stride);
  section.only_these();
  layout.each = std::move(each);
}

void read_checksum(Section& section, ByteOrder order, Layout& layout) {
  if (!section.there()) {
    return;
  }
  Checksum sum;
  sum.line = section.line();
  sum.algorithm = section.word("algorithm", checksum_algorithms(), true).value_or("crc32c");
  sum.field.name = "checksum";
  sum.field.line = section.line();
  sum.field.at = section.whole("at", 0, longest_record - 1, true).value_or(0);
  read_type(section, order, 4, sum.field);
  if (sum.field.type.kind != Kind::unsigned_integer || sum.field.type.bytes != checksum_bytes(sum.algorithm)) {
    section.fault("type", fmt::format("{} is u{}", sum.algorithm, 8 * checksum_bytes(sum.algorithm)));
  }
  sum.from = section.whole("from", 0, longest_record - 1, true).value_or(0);
  sum.to = section.whole("to", 1, longest_record, true).value_or(1);
  if (sum.to <= sum.from || sum.to > layout.bytes) {
    section.fault("to", fmt::format("covers bytes {} to {} of a record of {}", sum.from, sum.to, layout.bytes));
  }
  section.only_these();
  layout.checksum = std::move(sum);
}

void read_given(Section& section, const RecordRole& role, Record& record) {
  for (const std::string& name : section.keys()) {
    const RoleField* known = find_role(role, name);
    const bool takes =
        known != nullptr && !known->repeated && !known->text && known->words.empty() && known->count == 1;
    const auto value = section.number(name, -1e300, 1e300);
    if (!takes) {
      section.fault(name, fmt::format("{} has no such value to be given", role.table));
    } else if (record.layout.find(name) != nullptr) {
      section.fault(name, "the record has a field of that name: it is told, not given");
    } else if (value) {
      record.given.emplace(name, *value);
    }
  }
}

// Behind the fixed fields begin the repeated ones.
void check_record(Section& section, const Layout& layout) {
  std::vector<Extent> extents;
  for (const Field& field : layout.fields) {
    extents.push_back(extent_of(field));
  }
  const bool open = layout.each && layout.bytes == 0;
  if (layout.checksum) {
    extents.push_back(extent_of(layout.checksum->field));
  }
  if (layout.each) {
    const std::size_t end = layout.each->at + layout.each->stride * std::max<std::size_t>(layout.each->most, 1);
    if (!open && end > layout.bytes) {
      section.fault("each", fmt::format("bytes {} to {} of {}", layout.each->at, end - 1, layout.bytes));
    }
    extents.push_back({"each", section.line_of("each"), layout.each->at, end});
  }
  check_extents(section, "fields.", extents, open ? std::numeric_limits<std::size_t>::max() : layout.bytes);
}

}  // namespace

void read_layout(Section& section, const RecordRole& role, ByteOrder order, Record& record,
                 std::string_view numbered_by) {
  const bool in_places = numbered_by.empty();
  Layout& layout = record.layout;
  layout.record = role.table;
  std::ranges::replace(layout.record, '_', ' ');
  const bool may_be_open = std::ranges::any_of(role.fields, &RoleField::repeated);
  Section fields = section.table("fields");
  if (in_places) {
    layout.bytes = section.whole("bytes", 1, longest_record, fields.there() && !may_be_open).value_or(0);
    layout.fill = static_cast<std::uint8_t>(section.whole("fill", 0, 255).value_or(0));
  }
  read_fields_of(fields, role, false, order, numbered_by, layout.fields);
  if (!in_places) {
    layout.bytes = layout.fields.empty() ? 0 : layout.fields.back().end();
  }
  Section each = section.table("each", may_be_open && section.there());
  if (!may_be_open && each.there()) {
    section.fault("each", fmt::format("nothing is repeated in {}", role.table));
  } else {
    read_repetition(each, role, order, layout);
  }
  if (in_places) {
    Section checksum = section.table("checksum");
    read_checksum(checksum, order, layout);
  }
  Section given = section.table("given");
  read_given(given, role, record);
  if (fields.there() || each.there()) {
    check_record(section, layout);
  }
  for (const RoleField& field : role.fields) {
    if (field.needed && layout.find(field.name) == nullptr && !record.given.contains(field.name)) {
      section.missing(fmt::format("{}{}", field.repeated ? "each.fields." : "fields.", field.name));
    }
  }
}

}  // namespace selfcal::profile
