#include "protocol/odx/dictionary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/profile/coefficient_fields.hpp"

namespace selfcal::odx {
namespace {

using profile::Field;
using profile::Kind;
using profile::Layout;
using profile::RecordRole;
using profile::RoleField;

constexpr std::size_t byte_bits = 8;
// ISO 22901-1, 7.3.6.2: A_INT32 and A_UINT32 have 32 bits at most.
constexpr std::size_t most_integer_bits = 32;

const RoleField* known_field(const Field& field, const RecordRole& role) {
  const auto found = std::ranges::find(role.fields, field.name, &RoleField::name);
  return found == role.fields.end() ? nullptr : &*found;
}

Coded coded_of(const Field& field) {
  const bool little = field.order == profile::ByteOrder::little && field.type.bytes > 1;
  const std::size_t bits = field.bits > 0 ? field.bits : byte_bits * field.type.bytes;
  switch (field.type.kind) {
    case Kind::signed_integer: return {"A_INT32", "2C", bits, little};
    case Kind::floating: return {field.type.bytes == 4 ? "A_FLOAT32" : "A_FLOAT64", "IEEE754", bits, little};
    case Kind::text: return {"A_ASCIISTRING", "ISO-8859-1", bits, false};
    default: return unsigned_coded(bits, little);
  }
}

// First byte and lowest bit of a field, as ODX counts: the bits from there on fill as few bytes as hold them.
struct Place {
  std::size_t byte = 0, bit = 0;
};
Place place_of(const Field& field, std::size_t at) {
  if (field.bits == 0) {
    return {at, 0};
  }
  const std::size_t lowest = field.first_bit / byte_bits;
  const std::size_t highest = (field.first_bit + field.bits - 1) / byte_bits;
  const bool big = field.order == profile::ByteOrder::big;
  return {big ? at + field.type.bytes - 1 - highest : at + lowest, field.first_bit % byte_bits};
}

// Elements by the names of the 24 where they are of them, else by number.
std::string element_name(const Field& field, std::size_t k) {
  if (field.count == 1) {
    return short_name(field.name);
  }
  const auto span = profile::span_of(field.name);
  if (!span) {
    return fmt::format("{}_{}", short_name(field.name), k);
  }
  const std::string_view own = ins::coefficient_names[span->first + k];
  return span->one_factor ? fmt::format("{}{}", field.name, own.substr(own.rfind('_'))) : std::string(own);
}

std::string checksum_words(const Layout& layout) {
  return fmt::format("{} of bytes {} to {}", layout.checksum->algorithm, layout.checksum->from,
                     layout.checksum->to - 1);
}

}  // namespace

Coded unsigned_coded(std::size_t bits, bool little) { return {"A_UINT32", "", bits, little}; }

void add_coded_type(Node parent, const Coded& coded) {
  Node type = add(parent, "DIAG-CODED-TYPE");
  attribute(type, "BASE-DATA-TYPE", coded.base);
  if (!coded.encoding.empty()) {
    attribute(type, "BASE-TYPE-ENCODING", coded.encoding);
  }
  if (coded.little) {
    attribute(type, "IS-HIGHLOW-BYTE-ORDER", "false");
  }
  attribute(type, "xsi:type", "STANDARD-LENGTH-TYPE");
  add_number(type, "BIT-LENGTH", coded.bits);
}

Node add_parameter(Node params, std::string_view type, std::string_view name_, std::string_view semantic,
                   std::size_t byte, std::size_t bit, std::string_view words) {
  Node param = add(params, "PARAM");
  if (!semantic.empty()) {
    attribute(param, "SEMANTIC", semantic);
  }
  attribute(param, "xsi:type", type);
  name(param, name_, words);
  add_number(param, "BYTE-POSITION", byte);
  if (bit > 0) {
    add_number(param, "BIT-POSITION", bit);
  }
  return param;
}

void add_coded_constant(Node params, std::string_view name, std::string_view semantic, std::size_t byte,
                        std::size_t bits, std::uint64_t value) {
  Node param = add_parameter(params, "CODED-CONST", name, semantic, byte);
  add_number(param, "CODED-VALUE", value);
  add_coded_type(param, unsigned_coded(bits));
}

Dictionary::Dictionary(Node spec, std::vector<std::string>& lost) : spec_(spec), lost_(lost) {
  properties_ = add(spec, "DATA-OBJECT-PROPS");
  structures_ = add(spec, "STRUCTURES");
  repetitions_ = add(spec, "DYNAMIC-LENGTH-FIELDS");
  Node unit_spec = add(spec, "UNIT-SPEC");
  units_ = add(unit_spec, "UNITS");
  dimensions_ = add(unit_spec, "PHYSICAL-DIMENSIONS");
}

void Dictionary::end() {
  if (!repetitions_.first_child()) {
    spec_.remove_child(repetitions_);
  }
  Node unit_spec = spec_.child("UNIT-SPEC");
  if (!dimensions_.first_child()) {
    unit_spec.remove_child(dimensions_);
  }
  if (!units_.first_child()) {
    spec_.remove_child(unit_spec);
  }
}

// ISO 22901-1, 7.3.6.6: exponents of the SI's base quantities.
std::string Dictionary::dimension(std::string_view quantity) {
  struct Exponents {
    std::string_view quantity;
    int length, time, temperature;
  };
  constexpr Exponents table[] = {{"length", 1, 0, 0},     {"time", 0, 1, 0},          {"velocity", 1, -1, 0},
                                 {"frequency", 0, -1, 0}, {"acceleration", 1, -2, 0}, {"rate", 0, -1, 0},
                                 {"temperature", 0, 0, 1}};
  const auto found = std::ranges::find(table, quantity, &Exponents::quantity);
  if (found == std::end(table)) {
    return "";  // angles and plain numbers have none
  }
  std::string id = fmt::format("DIM.{}", quantity);
  if (known_.emplace(id, id).second) {
    Node node = add_named(dimensions_, "PHYSICAL-DIMENSION", id, quantity);
    for (const auto& [tag, exponent] : {std::pair("LENGTH-EXP", found->length), std::pair("TIME-EXP", found->time),
                                        std::pair("TEMPERATURE-EXP", found->temperature)}) {
      if (exponent != 0) {
        add(node, tag, std::to_string(exponent));
      }
    }
  }
  return id;
}

std::string Dictionary::unit(const std::string& name) {
  const profile::Unit* own = profile::find_unit(name);
  if (own == nullptr || name.empty() || name == "1") {
    return "";
  }
  std::string plain = name;
  constexpr std::pair<std::string_view, std::string_view> spelt[] = {{"^2", "2"}, {"/", "_per_"}, {"%", "percent"}};
  for (const auto& [sign, word] : spelt) {
    if (const auto at = plain.find(sign); at != std::string::npos) {
      plain.replace(at, sign.size(), word);
    }
  }
  std::string id = fmt::format("UNIT.{}", plain);
  if (known_.emplace(id, id).second) {
    Node node = add_named(units_, "UNIT", id, plain);
    add(node, "DISPLAY-NAME", name);
    constexpr double zero_celsius = 273.15;
    add(node, "FACTOR-SI-TO-UNIT", fmt::format("{:.17g}", 1.0 / own->si));
    add(node, "OFFSET-SI-TO-UNIT", own->quantity == "temperature" ? fmt::format("{}", -zero_celsius) : "0");
    if (const std::string of = dimension(own->quantity); !of.empty()) {
      refer(node, "PHYSICAL-DIMENSION-REF", of);
    }
  }
  return id;
}

std::string Dictionary::property(const Coded& coded, const Scale& scale,
                                 const std::map<std::uint64_t, std::string>& words) {
  const std::string what = fmt::format("{} {} {} {} {:.17g} {:.17g} {} {}", coded.base, coded.encoding, coded.bits,
                                       coded.little, scale.factor, scale.offset, scale.unit, words);
  const auto [found, fresh] = known_.emplace(what, fmt::format("DOP.{}", known_.size()));
  if (!fresh) {
    return found->second;
  }
  const std::string id = found->second;
  const std::string of_unit = unit(scale.unit);
  Node node = add_named(properties_, "DATA-OBJECT-PROP", id, "property_" + id.substr(4));
  Node method = add(node, "COMPU-METHOD");
  const bool linear = scale.factor != 1.0 || scale.offset != 0.0;
  add(method, "CATEGORY", !words.empty() ? "TEXTTABLE" : linear ? "LINEAR" : "IDENTICAL");
  if (!words.empty() || linear) {
    Node scales = add(add(method, "COMPU-INTERNAL-TO-PHYS"), "COMPU-SCALES");
    for (const auto& [number, word] : words) {
      Node one = add(scales, "COMPU-SCALE");
      add_number(one, "LOWER-LIMIT", number);
      add_number(one, "UPPER-LIMIT", number);
      add(add(one, "COMPU-CONST"), "VT", word);
    }
    if (words.empty()) {
      Node coefficients = add(add(scales, "COMPU-SCALE"), "COMPU-RATIONAL-COEFFS");
      Node numerator = add(coefficients, "COMPU-NUMERATOR");
      add(numerator, "V", fmt::format("{:.16g}", scale.offset));
      add(numerator, "V", fmt::format("{:.16g}", scale.factor));
      add(add(coefficients, "COMPU-DENOMINATOR"), "V", "1");
    }
  }
  add_coded_type(node, coded);
  const std::string type = !words.empty() ? "A_UNICODE2STRING" : linear ? "A_FLOAT64" : coded.base;
  attribute(add(node, "PHYSICAL-TYPE"), "BASE-DATA-TYPE", type == "A_ASCIISTRING" ? "A_UNICODE2STRING" : type);
  if (!of_unit.empty()) {
    refer(node, "UNIT-REF", of_unit);
  }
  return id;
}

std::string Dictionary::number(std::size_t bits) { return property(unsigned_coded(bits), {}, {}); }
std::string Dictionary::bytes(std::size_t count) {
  return property({"A_BYTEFIELD", "", byte_bits * count, false}, {}, {});
}
std::string Dictionary::words(std::size_t bits, const std::map<std::uint64_t, std::string>& words) {
  return property(unsigned_coded(bits), {}, words);
}

std::string Dictionary::rest(bool text) {
  const std::string id = text ? "DOP.text_to_the_end" : "DOP.bytes_to_the_end";
  if (known_.emplace(id, id).second) {
    Node node = add_named(properties_, "DATA-OBJECT-PROP", id, id.substr(4));
    add(add(node, "COMPU-METHOD"), "CATEGORY", "IDENTICAL");
    Node type = add(node, "DIAG-CODED-TYPE");
    attribute(type, "BASE-DATA-TYPE", text ? "A_ASCIISTRING" : "A_BYTEFIELD");
    attribute(type, "TERMINATION", "END-OF-PDU");
    attribute(type, "xsi:type", "MIN-MAX-LENGTH-TYPE");
    add(type, "MIN-LENGTH", "0");
    attribute(add(node, "PHYSICAL-TYPE"), "BASE-DATA-TYPE", text ? "A_UNICODE2STRING" : "A_BYTEFIELD");
  }
  return id;
}

std::string Dictionary::counted_text() {
  const std::string id = "DOP.text_behind_its_length";
  if (known_.emplace(id, id).second) {
    Node node = add_named(properties_, "DATA-OBJECT-PROP", id, id.substr(4));
    add(add(node, "COMPU-METHOD"), "CATEGORY", "IDENTICAL");
    Node type = add(node, "DIAG-CODED-TYPE");
    attribute(type, "BASE-DATA-TYPE", "A_ASCIISTRING");
    attribute(type, "xsi:type", "LEADING-LENGTH-INFO-TYPE");
    add(type, "BIT-LENGTH", "16");
    attribute(add(node, "PHYSICAL-TYPE"), "BASE-DATA-TYPE", "A_UNICODE2STRING");
  }
  return id;
}

// ODX has no integers of 64 bits: the upper and the lower half, each a number.
void Dictionary::add_halves(Node params, const Field& field, const std::string& name, std::size_t at,
                            const std::string& words) {
  const bool big = field.order == profile::ByteOrder::big;
  Coded high = coded_of(field), low = unsigned_coded(most_integer_bits, !big);
  high.bits = most_integer_bits;
  constexpr std::size_t half = 4;
  const std::string of = fmt::format("{}; times 2 to the 32, plus {}_low", words, name);
  refer(add_parameter(params, "VALUE", name + "_high", "DATA", big ? at : at + half, 0, of), "DOP-REF",
        property(high, {}, {}));
  refer(add_parameter(params, "VALUE", name + "_low", "DATA", big ? at + half : at, 0, words), "DOP-REF",
        property(low, {}, {}));
  lost_.push_back(fmt::format("{} has 64 bits, ODX's integers have 32: it is told in two halves, {}_high and {}_low",
                              name, name, name));
}

void Dictionary::add_constant(Node params, const Field& field, std::size_t at) {
  const Place place = place_of(field, at);
  const Coded coded = coded_of(field);
  if (field.type.kind != Kind::floating && coded.bits > most_integer_bits) {
    lost_.push_back(fmt::format("{} has 64 bits and is always the same: ODX does not know which", field.name));
    return;
  }
  Node param = add_parameter(params, "CODED-CONST", short_name(field.name), "DATA", place.byte, place.bit);
  const auto raw = static_cast<double>((*field.constant - field.offset) / field.scale);
  add(param, "CODED-VALUE",
      field.type.kind == Kind::floating ? fmt::format("{:.17g}", raw) : std::to_string(std::llround(raw)));
  add_coded_type(param, coded);
}

void Dictionary::add_element(Node params, const Field& field, const RecordRole& role, const std::string& name,
                             std::size_t at) {
  const RoleField* known = known_field(field, role);
  const std::string meaning(known == nullptr ? "" : known->meaning);
  Coded coded = coded_of(field);
  const bool integer = field.type.kind == Kind::unsigned_integer || field.type.kind == Kind::signed_integer;
  if (integer && coded.bits > most_integer_bits) {
    return add_halves(params, field, name, at, meaning);
  }
  std::map<std::uint64_t, std::string> words;
  if (known != nullptr && !known->words.empty()) {
    for (std::size_t ours = 0; ours < known->words.size(); ++ours) {
      const auto theirs = field.codes.find(ours);
      if (field.codes.empty() || theirs != field.codes.end()) {
        words.emplace(field.codes.empty() ? ours : theirs->second, known->words[ours]);
      }
    }
  }
  Scale scale;
  if (known != nullptr && words.empty() && field.type.kind != Kind::text) {
    scale.unit = field.unit.empty() ? std::string(known->unit) : field.unit;
    const profile::Unit* own = profile::find_unit(scale.unit);
    const profile::Unit* ours = profile::find_unit(known->unit);
    const double factor = own->si / ours->si;  // the layout's scale leads to our unit
    scale.factor = field.scale / factor;
    scale.offset = field.offset / factor;
  }
  const Place place = place_of(field, at);
  Node param = add_parameter(params, "VALUE", name, "DATA", place.byte, place.bit, meaning);
  refer(param, "DOP-REF", property(coded, scale, words));
}

void Dictionary::add_field(Node params, const Field& field, const RecordRole& role) {
  if (field.constant) {
    return add_constant(params, field, field.at);
  }
  for (std::size_t k = 0; k < field.count; ++k) {
    add_element(params, field, role, element_name(field, k), field.at + k * field.type.bytes);
  }
}

// The field that counts is the repetition's own, no parameter beside it.
void Dictionary::add_repetition(Node params, const std::string& name, const Layout& layout, const RecordRole& role) {
  const Layout::Repetition& each = *layout.each;
  const Field* count = layout.find(each.count);
  const std::string item = fmt::format("STRUCT.{}.item", name);
  Node structure = add_named(structures_, "STRUCTURE", item, short_name(name + "_item"));
  ++count_;
  add_number(structure, "BYTE-SIZE", each.stride);
  Node of_item = add(structure, "PARAMS");
  for (const Field& field : each.fields) {
    add_field(of_item, field, role);
  }
  const std::string id = fmt::format("FIELD.{}", name);
  Node repetition = add_named(repetitions_, "DYNAMIC-LENGTH-FIELD", id, short_name(name + "_items"));
  refer(repetition, "BASIC-STRUCTURE-REF", item);
  add_number(repetition, "OFFSET", each.at);
  Node number = add(repetition, "DETERMINE-NUMBER-OF-ITEMS");
  const Place place = place_of(*count, count->at);
  add_number(number, "BYTE-POSITION", place.byte);
  if (place.bit > 0) {
    add_number(number, "BIT-POSITION", place.bit);
  }
  refer(number, "DATA-OBJECT-PROP-REF", property(coded_of(*count), {}, {}));
  refer(add_parameter(params, "VALUE", short_name(each.count), "DATA", 0, 0,
                      fmt::format("{} repetitions at most", each.most)),
        "DOP-REF", id);
  lost_.push_back(fmt::format("{}: at most {} repetitions", name, each.most));
}

std::string Dictionary::structure(const std::string& name, const Layout& layout, const RecordRole& role) {
  const std::string id = fmt::format("STRUCT.{}", name);
  if (!known_.emplace(id, id).second) {
    return id;
  }
  Node params;
  {
    Node structure = add_named(structures_, "STRUCTURE", id, short_name(name), role.meaning);
    ++count_;
    if (layout.bytes > 0) {
      add_number(structure, "BYTE-SIZE", layout.bytes);
    }
    params = add(structure, "PARAMS");
  }
  for (const Field& field : layout.fields) {
    if (!layout.each || field.name != layout.each->count) {
      add_field(params, field, role);
    }
  }
  if (layout.each) {
    add_repetition(params, name, layout, role);
  }
  if (layout.checksum) {
    const Field& field = layout.checksum->field;
    refer(add_parameter(params, "VALUE", "checksum", "DATA", field.at, 0, checksum_words(layout)), "DOP-REF",
          property(coded_of(field), {}, {}));
    lost_.push_back(
        fmt::format("{}: how its checksum is made, {}; the number itself stands", name, checksum_words(layout)));
  }
  if (layout.fill != 0) {
    lost_.push_back(fmt::format("{}: bytes that no field has are 0x{:02X}", name, layout.fill));
  }
  return id;
}

}  // namespace selfcal::odx
