// The table of cases, TOML (README.md).
#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "sim_ins/toml_reader.hpp"
#include "tests/hostile/rule.hpp"

namespace selfcal::hostile {
namespace {

struct Entry {
  std::string name, request, field, signal, action = "set", bytes, end = "failed", says, values;
  std::uint64_t at = 1, times = 0, count = 0, offset = 0;
  double seconds = 0.0;
  bool reaches_ins = true;
};

Entry read_entry(sim::TomlTable& table) {
  Entry e;
  table.text("name", e.name);
  table.text("request", e.request);
  table.text("field", e.field);
  table.text("signal", e.signal);
  table.text("action", e.action);
  table.text("bytes", e.bytes);
  table.text("end", e.end);
  table.text("says", e.says);
  table.text("values", e.values);
  table.integer("at", e.at, 1, 1U << 20U);
  table.integer("times", e.times, 0, 1U << 20U);
  table.integer("count", e.count, 0, 0xFFFFFFFF);
  table.integer("offset", e.offset, 0, 1U << 20U);
  table.number("seconds", e.seconds, 0.0, 1e6);
  table.boolean("reaches_ins", e.reaches_ins);
  return e;
}

const Field* field_called(const std::string& name) {
  const auto found = std::ranges::find(fields(), name, &Field::name);
  return found == fields().end() ? nullptr : &*found;
}

std::optional<Ending> ending_called(const std::string& name) {
  if (name == "any") {
    return Ending::any;
  }
  return name == "failed"      ? std::optional(Ending::failed)
         : name == "completed" ? std::optional(Ending::completed)
                               : std::nullopt;
}

// The rule of an entry without the value, which the caller gives.
Expected<Rule> rule_of(const Entry& e) {
  Rule rule;
  const auto kind = kind_called(e.action);
  const auto request = hex_bytes(e.request);
  const auto bytes = hex_bytes(e.bytes);
  if (!kind || !request || !bytes) {
    return fail(ErrorKind::bad_input, fmt::format("case '{}': action '{}', request '{}' or bytes '{}'", e.name,
                                                  e.action, e.request, e.bytes));
  }
  rule.kind = *kind;
  rule.request = *request;
  rule.bytes = *bytes;
  rule.at = static_cast<std::uint32_t>(e.at);
  rule.times = static_cast<std::uint32_t>(e.times);
  rule.count = static_cast<std::uint32_t>(e.count);
  rule.offset = e.offset;
  rule.seconds = e.seconds;
  rule.signal = e.signal;
  if (const Field* field = e.field.empty() ? nullptr : field_called(e.field)) {
    rule.request = *hex_bytes(field->request);
    rule.offset = field->offset;
    rule.seal = field->seal;
  } else if (!e.field.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("case '{}': no field is called '{}'", e.name, e.field));
  }
  return rule;
}

Expected<void> add_cases(const Entry& e, std::vector<Case>& cases) {
  const auto rule = rule_of(e);
  const auto ending = ending_called(e.end);
  if (!rule || !ending) {
    return rule ? Expected<void>(fail(ErrorKind::bad_input, fmt::format("case '{}': end '{}'", e.name, e.end)))
                : tl::unexpected(rule.error());
  }
  Case one{e.name, {*rule}, *ending, e.says, e.reaches_ins};
  if (e.name.empty()) {
    one.name = e.action + " " + (e.field.empty() ? e.signal.empty() ? e.request : e.signal : e.field);
  }
  if (e.at != 1) {
    one.name += fmt::format(" from {}", e.at);
  }
  if (e.values.empty()) {
    cases.push_back(one);
    return {};
  }
  std::istringstream words(e.values);
  for (std::string word; words >> word;) {
    Case with_value = one;
    with_value.name += " = " + word;
    Rule& r = with_value.rules[0];
    const Field* field = field_called(e.field);
    const auto bytes = value_bytes(field != nullptr ? field->type : '4', word);
    if (!bytes) {
      return fail(ErrorKind::bad_input, fmt::format("case '{}': value '{}'", one.name, word));
    }
    if (field != nullptr) {
      r.bytes = *bytes;
    } else {
      r.count = static_cast<std::uint32_t>((*bytes)[0] << 24U | (*bytes)[1] << 16U | (*bytes)[2] << 8U | (*bytes)[3]);
    }
    cases.push_back(with_value);
  }
  return {};
}

}  // namespace

Expected<std::vector<Case>> read_cases(const std::string& path) {
  const auto text = sim::read_text(path);
  if (!text) {
    return tl::unexpected(text.error());
  }
  std::vector<Case> cases;
  Expected<void> sound;
  const auto read = sim::read_toml(*text, path, [&](sim::TomlTable& root) {
    root.tables("case", [&](sim::TomlTable& table) {
      const Entry entry = read_entry(table);
      if (sound) {
        sound = add_cases(entry, cases);
      }
    });
  });
  if (!read || !sound) {
    return tl::unexpected(read ? sound.error() : read.error());
  }
  return cases;
}

}  // namespace selfcal::hostile
