// A document as one self-contained page: it holds the document, the program and the plotting library, and asks no
// network. The document's "kind" says which page it is: calibration, plan, fleet,
// investigation, overlay or poses.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "protocol/error.hpp"

namespace selfcal::report {

std::string page(const nlohmann::ordered_json& document);

// Writes the page; a name that ends in .pdf is printed to A4 by a headless Chromium, which must be installed.
Expected<void> write_page(const nlohmann::ordered_json& document, const std::filesystem::path& file);

// A plotted number: six digits are far below a pixel.
double rounded(double value);
// Rounds every number of an array, at any depth.
void round_numbers(nlohmann::ordered_json& value);

}  // namespace selfcal::report
