// The parts of the pages, built into the program: ours from page/, the plotting library from npm.
#pragma once

#include <string_view>
#include <utility>
#include <vector>

namespace selfcal::report {

std::vector<std::string_view> page_styles();
std::vector<std::string_view> page_scripts();                              // in the order in which they must run
std::vector<std::pair<std::string_view, std::string_view>> page_bodies();  // kind of document, body

}  // namespace selfcal::report
