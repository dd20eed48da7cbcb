// Backups of the database, and the way back: file names in the state directory.
#pragma once

#include <filesystem>
#include <string>

#include "protocol/error.hpp"

namespace selfcal {

std::filesystem::path database_path(const std::filesystem::path& state_directory);

// `name`: a plain file name in the state directory's folder "backups"; fails with usage where it is none.
Expected<std::filesystem::path> backup_path(const std::filesystem::path& state_directory, const std::string& name);

// Copies the database while it is in use. Returns where to.
Expected<std::filesystem::path> back_up_database(const std::filesystem::path& state_directory, const std::string& name);

// Puts a sound backup in the database's place. What was there, sound or not, stays beside it under the name that is
// returned (empty: nothing was). Nobody may have the database open; a crash in between leaves one or the other.
Expected<std::filesystem::path> restore_database(const std::filesystem::path& state_directory, const std::string& name);

}  // namespace selfcal
