// XML elements as ODX has them: a text in an element, an ID, a reference to one.
#pragma once

#include <pugixml.hpp>

#include <cstddef>
#include <string>
#include <string_view>

namespace selfcal::odx {

using Node = pugi::xml_node;

Node add(Node parent, const char* tag);
Node add(Node parent, const char* tag, std::string_view text);
Node add_number(Node parent, const char* tag, std::size_t number);
void attribute(Node node, const char* name, std::string_view value);
// With ID and SHORT-NAME; DESC where there are words.
Node add_named(Node parent, const char* tag, std::string_view id, std::string_view short_name,
               std::string_view words = {});
// SHORT-NAME and DESC, in that order.
void name(Node node, std::string_view short_name, std::string_view words = {});
void refer(Node parent, const char* tag, std::string_view id);
// To another file's element.
void refer(Node parent, const char* tag, std::string_view id, std::string_view document, const char* type);

// Letters, digits and _, as a SHORT-NAME has to be.
std::string short_name(std::string_view name);

// An ODX file: its root, and its text.
Node begin_odx(pugi::xml_document& document);
std::string text_of(const pugi::xml_document& document);

}  // namespace selfcal::odx
