#include "protocol/odx/node.hpp"

#include <algorithm>
#include <sstream>

namespace selfcal::odx {

Node add(Node parent, const char* tag) { return parent.append_child(tag); }

Node add(Node parent, const char* tag, std::string_view text) {
  Node node = add(parent, tag);
  node.text().set(std::string(text).c_str());
  return node;
}

Node add_number(Node parent, const char* tag, std::size_t number) { return add(parent, tag, std::to_string(number)); }

void attribute(Node node, const char* name, std::string_view value) {
  node.append_attribute(name).set_value(std::string(value).c_str());
}

void name(Node node, std::string_view short_name, std::string_view words) {
  add(node, "SHORT-NAME", short_name);
  if (!words.empty()) {
    add(add(node, "DESC"), "p", words);
  }
}

Node add_named(Node parent, const char* tag, std::string_view id, std::string_view short_name, std::string_view words) {
  Node node = add(parent, tag);
  attribute(node, "ID", id);
  name(node, short_name, words);
  return node;
}

void refer(Node parent, const char* tag, std::string_view id) { attribute(add(parent, tag), "ID-REF", id); }

void refer(Node parent, const char* tag, std::string_view id, std::string_view document, const char* type) {
  Node node = add(parent, tag);
  attribute(node, "ID-REF", id);
  attribute(node, "DOCREF", document);
  attribute(node, "DOCTYPE", type);
}

std::string short_name(std::string_view name) {
  std::string made(name);
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  std::ranges::replace_if(
      made, [&](char c) { return !allowed(c); }, '_');
  constexpr std::size_t longest = 128;
  return made.empty() ? "_" : made.substr(0, longest);
}

Node begin_odx(pugi::xml_document& document) {
  Node declaration = document.append_child(pugi::node_declaration);
  attribute(declaration, "version", "1.0");
  attribute(declaration, "encoding", "UTF-8");
  Node root = document.append_child("ODX");
  attribute(root, "MODEL-VERSION", "2.2.0");
  attribute(root, "xmlns:xsi", "http://www.w3.org/2001/XMLSchema-instance");
  attribute(root, "xsi:noNamespaceSchemaLocation", "odx.xsd");
  return root;
}

std::string text_of(const pugi::xml_document& document) {
  std::ostringstream out;
  document.save(out, "  ");
  return out.str();
}

}  // namespace selfcal::odx
