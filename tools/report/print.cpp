#include "tools/report/print.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <vector>

#include "protocol/recording/atomic_file.hpp"

extern char** environ;

namespace selfcal::report {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 4> browsers = {"chromium", "chromium-browser", "google-chrome",
                                                 "google-chrome-stable"};

// A folder of its own, private and empty, that goes with its contents.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "selfcal-print-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) {
      path_ = name;
    }
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) {
      fs::remove_all(path_, ignored);
    }
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// Exit status of the program, or -1 where it cannot be started. What it says is dropped.
int run(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (const std::string& word : words) {
    arguments.push_back(const_cast<char*>(word.c_str()));  // posix_spawn does not write to them
  }
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_WRONLY, 0);
  }
  pid_t child = 0;
  const int failed = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  if (failed != 0 || waitpid(child, &status, 0) != child) {
    return -1;
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

Expected<void> print_page(const std::string& page, const fs::path& pdf) {
  const TemporaryFolder folder;
  if (folder.path().empty()) {
    return fail(ErrorKind::internal,
                fmt::format("{}: no temporary folder could be made", fs::temp_directory_path().string()));
  }
  const fs::path html = folder.path() / "page.html";
  const fs::path printed = folder.path() / "page.pdf";
  std::ofstream(html) << page;
  for (const char* browser : browsers) {
    std::vector<std::string> words = {browser,
                                      "--headless",
                                      "--disable-gpu",
                                      "--disable-dev-shm-usage",
                                      "--no-first-run",
                                      "--no-pdf-header-footer",
                                      "--user-data-dir=" + (folder.path() / "profile").string(),
                                      "--print-to-pdf=" + printed.string()};
    if (geteuid() == 0) {
      words.emplace_back("--no-sandbox");  // Chromium refuses root otherwise; the page is ours and asks no network
    }
    words.push_back("file://" + html.string());
    if (run(words) == 0 && fs::exists(printed)) {
      const auto contents = read_text_file(printed, 100'000'000);
      return contents ? write_file_atomically(pdf, *contents) : tl::unexpected(contents.error());
    }
  }
  return fail(ErrorKind::device, fmt::format("{}: no Chromium in PATH that prints the page: write HTML and print it "
                                             "from a browser",
                                             pdf.string()));
}

}  // namespace selfcal::report
