// The name that a page of raw data has as a file of the INS: a pattern with {page}, and perhaps {run}.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace selfcal::profile {

// "{page:6}": with zeros to six digits. Empty: the pattern is sound; else what is wrong with it.
std::string fault_of_file_pattern(std::string_view pattern);

// Of a sound pattern.
std::string file_name(std::string_view pattern, std::uint32_t run, std::uint32_t page);

// The page whose file has just this name in this run.
std::optional<std::uint32_t> page_of_file(std::string_view pattern, std::uint32_t run, std::string_view name);

}  // namespace selfcal::profile
