// A recording from one file form into the other. Data faults that an estimate refuses may be carried over.
#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

#include "protocol/error.hpp"
#include "protocol/recording/check.hpp"

namespace selfcal::cli {

inline constexpr CheckPolicy lenient{
    .gaps_are_errors = false, .gimbal_contradiction_is_error = false, .uneven_force_is_error = false};

using RecordingReader = std::function<Expected<LoadedRecording>(const std::filesystem::path&, const CheckPolicy&)>;
using RecordingWriter = std::function<Expected<void>(const Recording&, const std::filesystem::path&)>;

// Warnings go to standard error, a line each. Returns the exit status.
Expected<int> convert(const std::string& command, const std::string& from, const std::string& to,
                      std::initializer_list<std::string_view> endings, const RecordingReader& read,
                      const RecordingWriter& write);

}  // namespace selfcal::cli
