#include "daemon/store/database_copies.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <system_error>

#include "daemon/host/wall_clock.hpp"
#include "daemon/store/run_store.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;

fs::path with_suffix(fs::path file, const std::string& suffix) { return file += suffix; }

void remove_with_journals(const fs::path& database) {
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm"}) {
    fs::remove(with_suffix(database, suffix), ignored);
  }
}

// A database restored by root must be the service's again: it belongs to whom the directory belongs.
void give_to_owner_of(const fs::path& folder, const fs::path& file) {
  struct stat owner {};
  if (geteuid() != 0 || stat(folder.c_str(), &owner) != 0) {
    return;
  }
  // Fails on a file system without owners only, where there is nothing to give.
  [[maybe_unused]] const int given = chown(file.c_str(), owner.st_uid, owner.st_gid);
}

void sync_folder(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) {
    return;
  }
  fsync(fd);
  ::close(fd);
}

fs::path free_name(const fs::path& database) {
  const std::string stem = database.string() + ".before-restore-" + utc_now();
  fs::path name = stem;
  for (int i = 2; fs::exists(name); ++i) {
    name = fmt::format("{}-{}", stem, i);
  }
  return name;
}

}  // namespace

fs::path database_path(const fs::path& state_directory) { return state_directory / "selfcal.db"; }

Expected<fs::path> backup_path(const fs::path& state_directory, const std::string& name) {
  if (name.empty() || name.front() == '.' || name.find('/') != std::string::npos) {
    return fail(ErrorKind::usage, fmt::format("\"{}\": a plain file name is wanted", name));
  }
  return state_directory / "backups" / name;
}

Expected<fs::path> back_up_database(const fs::path& state_directory, const std::string& name) {
  auto target = backup_path(state_directory, name);
  if (!target) {
    return target;
  }
  std::error_code error;
  fs::create_directories(target->parent_path(), error);
  if (error) {
    return fail(ErrorKind::device, fmt::format("{}: {}", target->parent_path().string(), error.message()));
  }
  if (const auto copied = RunStore::copy(database_path(state_directory), *target); !copied) {
    return tl::unexpected(copied.error());
  }
  give_to_owner_of(state_directory, *target);
  return *target;
}

Expected<fs::path> restore_database(const fs::path& state_directory, const std::string& name) {
  auto backup = backup_path(state_directory, name);
  if (!backup) {
    return backup;
  }
  if (const auto sound = RunStore::check(*backup); !sound) {
    return tl::unexpected(sound.error());
  }
  const fs::path database = database_path(state_directory);
  const fs::path fresh = with_suffix(database, ".restoring");
  remove_with_journals(fresh);  // of an attempt that was broken off
  if (const auto copied = RunStore::copy(*backup, fresh); !copied) {
    return tl::unexpected(copied.error());
  }
  // Opened once, so that a newer schema is refused and an older one upgraded before anything is replaced.
  if (const auto usable = RunStore::open(fresh); !usable) {
    return tl::unexpected(usable.error());
  }
  give_to_owner_of(state_directory, fresh);

  std::error_code error;
  fs::path kept;
  if (fs::exists(database)) {
    kept = free_name(database);
    // The log goes first: it must never be replayed into another database.
    for (const char* suffix : {"-wal", "-shm"}) {
      if (fs::exists(with_suffix(database, suffix))) {
        fs::rename(with_suffix(database, suffix), with_suffix(kept, suffix), error);
        if (error) {
          return fail(ErrorKind::device, fmt::format("{}: {}", database.string() + suffix, error.message()));
        }
      }
    }
    fs::create_hard_link(database, kept, error);
    if (error) {
      return fail(ErrorKind::device, fmt::format("{}: {}", kept.string(), error.message()));
    }
  }
  fs::rename(fresh, database, error);
  if (error) {
    return fail(ErrorKind::device, fmt::format("{}: {}", database.string(), error.message()));
  }
  sync_folder(state_directory);
  return kept;
}

}  // namespace selfcal
