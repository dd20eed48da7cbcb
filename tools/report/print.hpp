// A page on A4 paper, as PDF: the browser that operators have prints it.
#pragma once

#include <filesystem>
#include <string>

#include "protocol/error.hpp"

namespace selfcal::report {

// Runs chromium (or google-chrome) from PATH without a window. device where there is none or it prints nothing.
Expected<void> print_page(const std::string& page, const std::filesystem::path& pdf);

}  // namespace selfcal::report
