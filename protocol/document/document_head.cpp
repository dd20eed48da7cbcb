#include "protocol/document/document_head.hpp"

#include <nlohmann/json.hpp>

#include "protocol/recording/file_hash.hpp"

namespace selfcal::document {

Expected<InputFile> identify_file(const std::string& path) {
  return sha256_of_file(path).map([&](const std::string& hash) { return InputFile{path, hash}; });
}

nlohmann::ordered_json head(const Schema& schema, const InputFile& input) {
  nlohmann::ordered_json document;
  document["schema"] = {{"name", schema.name}, {"version", schema.version}};
  document["program"] = {{"name", "selfcal"}, {"version", SELFCAL_VERSION}};
  if (!input.name.empty()) {
    document["input"] = {{"name", input.name}, {"sha256", input.sha256}};
  }
  return document;
}

nlohmann::ordered_json with_head(const Schema& schema, const nlohmann::ordered_json& body, const InputFile& input) {
  nlohmann::ordered_json document = head(schema, input);
  document.update(body);
  return document;
}

}  // namespace selfcal::document
