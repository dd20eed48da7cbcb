// The dictionary of an ODX layer: data object properties, structures, repetitions and units, each once, however often they are used.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/odx/node.hpp"
#include "protocol/profile/layout.hpp"
#include "protocol/profile/roles.hpp"

namespace selfcal::odx {

// How the bits of a number or a text stand.
struct Coded {
  std::string base;      // "A_UINT32"
  std::string encoding;  // "2C"; empty: the base's own
  std::size_t bits = 0;
  bool little = false;
};
Coded unsigned_coded(std::size_t bits, bool little = false);
void add_coded_type(Node parent, const Coded& coded);

class Dictionary {
 public:
  // Appends to the DIAG-DATA-DICTIONARY-SPEC; what ODX cannot hold goes to `lost`.
  Dictionary(Node spec, std::vector<std::string>& lost);

  // ID of a structure that is the record: its fields, its repetitions, its checksum.
  std::string structure(const std::string& name, const profile::Layout& layout, const profile::RecordRole& role);
  // ID of a property without scale: an unsigned number, so many bytes, text or bytes up to the end, the rest of a request.
  std::string number(std::size_t bits);
  std::string bytes(std::size_t count);
  std::string rest(bool text);
  // Text behind its length, in two bytes.
  std::string counted_text();
  std::string words(std::size_t bits, const std::map<std::uint64_t, std::string>& words);
  // Drops the lists that nothing stands in; the last call.
  void end();
  std::size_t structures() const { return count_; }

 private:
  struct Scale {
    double factor = 1.0, offset = 0.0;
    std::string unit;
  };
  void add_field(Node params, const profile::Field& field, const profile::RecordRole& role);
  void add_element(Node params, const profile::Field& field, const profile::RecordRole& role, const std::string& name,
                   std::size_t at);
  void add_halves(Node params, const profile::Field& field, const std::string& name, std::size_t at,
                  const std::string& words);
  void add_constant(Node params, const profile::Field& field, std::size_t at);
  void add_repetition(Node params, const std::string& name, const profile::Layout& layout,
                      const profile::RecordRole& role);
  std::string property(const Coded& coded, const Scale& scale, const std::map<std::uint64_t, std::string>& words);
  std::string unit(const std::string& name);
  std::string dimension(std::string_view quantity);

  Node properties_, structures_, repetitions_, spec_, units_, dimensions_;
  std::vector<std::string>& lost_;
  std::map<std::string, std::string> known_;  // what a property is, and its ID
  std::size_t count_ = 0;
};

// A parameter of a message or a structure: its SHORT-NAME, SEMANTIC and place.
Node add_parameter(Node params, std::string_view type, std::string_view name, std::string_view semantic,
                   std::size_t byte, std::size_t bit = 0, std::string_view words = {});
void add_coded_constant(Node params, std::string_view name, std::string_view semantic, std::size_t byte,
                        std::size_t bits, std::uint64_t value);

}  // namespace selfcal::odx
