// The head of every JSON document that our programs print or keep: which schema it follows, which version of the
// software made it and, where it answers for a file, which file. The schema files stand beside this header, in schemas/.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace selfcal::document {

// `version` counts up when a field is renamed, removed or changes its meaning. A new field leaves it as it is.
struct Schema {
  std::string_view name;
  int version = 1;
};

inline constexpr Schema estimate{"selfcal.estimate"};
inline constexpr Schema diagnosis{"selfcal.diagnosis"};
inline constexpr Schema comparison{"selfcal.comparison"};
inline constexpr Schema plan{"selfcal.plan"};
inline constexpr Schema poses{"selfcal.poses"};
inline constexpr Schema truth{"selfcal.truth"};
inline constexpr Schema run{"selfcal.run"};
inline constexpr Schema history{"selfcal.history"};
inline constexpr Schema status{"selfcal.status"};
inline constexpr Schema request{
    "selfcal.request"};  // what a request to the service led to: a run begun, an abort asked
inline constexpr Schema investigation{"selfcal.investigation"};
inline constexpr Schema bus{"selfcal.bus"};
inline constexpr Schema conformance{"selfcal.conformance"};  // answer of `selfcal device check`
inline constexpr Schema probe{"selfcal.probe"};              // answer of `selfcal device probe`
inline constexpr Schema database{"selfcal.database"};        // answer of `selfcal db`
inline constexpr Schema batch{"selfcal.batch"};              // `selfcal batch status`

// The file that a document answers for. An empty name stands for none.
struct InputFile {
  std::string name;    // as the user gave it
  std::string sha256;  // of the file's bytes, 64 hexadecimal digits; of a CSV recording, of the .csv alone
};

// Reads the file once. An error (bad_input) where it cannot be read.
Expected<InputFile> identify_file(const std::string& path);

// "schema" {name, version}, "program" {name, version} and, for a file, "input" {name, sha256}.
nlohmann::ordered_json head(const Schema& schema, const InputFile& input = {});

// The head, then the fields of `body` (an object).
nlohmann::ordered_json with_head(const Schema& schema, const nlohmann::ordered_json& body, const InputFile& input = {});

}  // namespace selfcal::document
