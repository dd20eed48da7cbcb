#include "tools/report/run_document.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "protocol/document/document_head.hpp"
#include "tools/report/run_words.hpp"

namespace selfcal::report {
namespace {

using Json = nlohmann::ordered_json;

Expected<Json> read(const std::string& text, const std::string& source, const std::vector<const char*>& keys) {
  Json document = Json::parse(text, nullptr, false);
  if (!document.is_object()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: not a JSON object", source));
  }
  for (const char* key : keys) {
    if (!document.contains(key)) {
      return fail(ErrorKind::bad_input, fmt::format("{}: \"{}\" is missing", source, key));
    }
  }
  return document;
}

Json value_or_null(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() ? Json() : *found;
}

// The last determined value before `utc`; null where there is none.
Json last_before(const Json& values, const std::string& utc) {
  Json last;
  for (const Json& value : values) {
    const bool earlier = utc.empty() || value.at("utc").get<std::string>() < utc;
    if (earlier && value.at("determined").get<bool>()) {
      last = value;
    }
  }
  return last;
}

std::string hash_of(const Json& document) {
  const Json input = value_or_null(document, "input");
  return input.is_object() ? input.value("sha256", std::string()) : std::string();
}

// The curves belong to the numbers only where both are of the same file.
void warn_of_another_file(Json& document, const Json& result, const std::optional<Json>& recomputed) {
  if (!recomputed || !result.is_object()) {
    return;
  }
  const std::string then = hash_of(result);
  const std::string now = hash_of(*recomputed);
  if (!then.empty() && !now.empty() && then != now) {
    document["warnings"].push_back(
        fmt::format("the recording is not the one of the run: SHA-256 {} then, {} now", then, now));
  }
}

}  // namespace

Expected<Json> read_run(const std::string& text, const std::string& source) {
  return read(text, source, {"run", "serial", "state", "started_utc", "events", "result"});
}

Expected<Json> read_history(const std::string& text, const std::string& source) {
  return read(text, source, {"serial", "runs", "parameters"});
}

Expected<std::optional<Json>> read_investigation(const std::string& text, const std::string& source) {
  const Json head = Json::parse(text, nullptr, false);
  const auto schema = head.is_object() ? head.find("schema") : head.end();
  if (schema == head.end() || !schema->is_object() ||
      schema->value("name", std::string()) != document::investigation.name) {
    return std::nullopt;
  }
  return read(text, source, {"steps", "ended", "written_by", "exit_status"}).map([](Json story) {
    story["kind"] = "investigation";
    return std::optional<Json>(std::move(story));
  });
}

Expected<std::optional<Json>> read_poses(const std::string& text, const std::string& source) {
  const Json head = Json::parse(text, nullptr, false);
  const auto schema = head.is_object() ? head.find("schema") : head.end();
  if (schema == head.end() || !schema->is_object() || schema->value("name", std::string()) != document::poses.name) {
    return std::nullopt;
  }
  return read(text, source, {"poses", "accelerometers", "gyros", "invisible"}).map([](Json poses) {
    poses["kind"] = "poses";
    return std::optional<Json>(std::move(poses));
  });
}

Json run_page_document(const Json& run, const std::optional<Json>& recomputed) {
  Json document = recomputed.value_or(Json::object());
  const Json result = value_or_null(run, "result");
  if (result.is_object()) {
    for (const auto& [key, value] : result.items()) {
      // The recomputation has the curves of the passes and the maps of the diagnosis; all else is what the operator was
      // told.
      const bool drawn = (key == "passes" || key == "diagnosis") && document.contains(key);
      if (!drawn) {
        document[key] = value;
      }
    }
  }
  warn_of_another_file(document, result, recomputed);
  document["kind"] = "calibration";
  document["run"] = run;
  document["run"].erase("result");
  document["summary"] = page_summary(document);
  document["force"] = force_of_run(document["run"]);
  return document;
}

void add_history(Json& document, const Json& history, const std::string& utc) {
  document["history"] = history;
  if (!document.contains("parameters")) {
    return;
  }
  for (Json& parameter : document["parameters"]) {
    for (const Json& past : history.at("parameters")) {
      if (past.at("name") != parameter.at("name")) {
        continue;
      }
      const Json last = last_before(past.at("values"), utc);
      if (last.is_object() && parameter.at("value").is_number()) {
        const double sigma = std::hypot(parameter.at("sigma").get<double>(), last.at("sigma").get<double>());
        parameter["change"] = {{"value", parameter.at("value").get<double>() - last.at("value").get<double>()},
                               {"sigma", sigma},
                               {"run", last.at("run")},
                               {"utc", last.at("utc")}};
      }
    }
  }
}

}  // namespace selfcal::report
