// The parts of the page, built into the program: ours from page/, the plotting library from npm.
#pragma once

#include <string_view>
#include <vector>

namespace selfcal::report {

std::vector<std::string_view> page_styles();
std::vector<std::string_view> page_scripts();   // in the order in which they must run
std::string_view page_body();

}  // namespace selfcal::report
