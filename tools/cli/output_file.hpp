// Whether a file may be written, asked before the work begins.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace selfcal::cli {

// An error of kind usage where the file's ending is none of ENDINGS, and of kind bad_input where its folder does not
// exist or cannot be written to.
Expected<void> check_output(const std::string& file, std::initializer_list<std::string_view> endings);

// The second half alone, for files of any ending.
Expected<void> check_folder(const std::string& file);

}  // namespace selfcal::cli
