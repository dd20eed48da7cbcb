// A column's name in words. Private to this folder.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace selfcal::import {

using Words = std::vector<std::string>;

// "GyroX" -> gyro x, "acc_x_m_s2" -> acc x m s2
Words words_of(std::string_view name);
// Whether a word holds one of these, or is one.
bool holds(const Words& words, std::initializer_list<std::string_view> parts);
bool is_one_of(const Words& words, std::initializer_list<std::string_view> whole);
// Whether a name holds one of PARTS, written small, wherever its words end.
bool name_says(std::string_view name, std::initializer_list<std::string_view> parts);

}  // namespace selfcal::import
