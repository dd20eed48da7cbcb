#include "tools/report/page.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "protocol/recording/atomic_file.hpp"
#include "tools/report/page_assets.hpp"
#include "tools/report/print.hpp"

namespace selfcal::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr double curve_digits = 6.0;

// JSON inside a <script> element: "</script>" and "<!--" must not appear, and "<" appears in strings only.
std::string script_safe(const Json& document) {
  const std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

}  // namespace

double rounded(double value) {
  if (value == 0.0 || !std::isfinite(value)) {
    return value;
  }
  const double scale = std::pow(10.0, curve_digits - 1.0 - std::floor(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}

void round_numbers(Json& value) {
  if (value.is_number_float()) {
    value = rounded(value.get<double>());
  } else if (value.is_array()) {
    std::for_each(value.begin(), value.end(), round_numbers);
  }
}

std::string page(const Json& document) {
  std::string text =
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<link rel=\"icon\" href=\"data:,\">\n<title>selfcal</title>\n<style>\n";
  for (const std::string_view style : page_styles()) {
    text += style;
  }
  text += "</style>\n</head>\n<body>\n";
  for (const auto& [kind, body] : page_bodies()) {
    if (kind == document.at("kind").get<std::string>()) {
      text += body;
    }
  }
  text += "<script type=\"application/json\" id=\"document\">" + script_safe(document) + "</script>\n";
  for (const std::string_view script : page_scripts()) {
    text += "<script>\n";
    text += script;
    text += "\n</script>\n";
  }
  return text + "</body>\n</html>\n";
}

Expected<void> write_page(const Json& document, const std::filesystem::path& file) {
  const std::string text = page(document);
  return file.extension() == ".pdf" ? print_page(text, file) : write_file_atomically(file, text);
}

}  // namespace selfcal::report
