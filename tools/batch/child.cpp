#include "tools/batch/child.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>

#include "protocol/recording/atomic_file.hpp"

namespace selfcal::batch {
namespace {

constexpr unsigned answer_limit_s = 60;
constexpr std::size_t longest_answer = 10'000'000;

bool redirect(const std::string& file, int stream) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  return descriptor >= 0 && ::dup2(descriptor, stream) == stream;
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

Expected<ChildEnd> wait_for(pid_t child, int options) {
  int status = 0;
  rusage usage{};
  const pid_t ended = ::wait4(child, &status, options, &usage);
  if (ended < 0) {
    return fail(ErrorKind::internal, fmt::format("no child to wait for: {}", std::strerror(errno)));
  }
  return ChildEnd{ended, WIFEXITED(status) ? WEXITSTATUS(status) : 0, WIFSIGNALED(status) ? WTERMSIG(status) : 0,
                  seconds(usage.ru_utime) + seconds(usage.ru_stime)};
}

}  // namespace

Expected<pid_t> start_child(const ChildCommand& command) {
  std::vector<char*> words;
  words.reserve(command.words.size() + 1);
  for (const std::string& word : command.words) {
    words.push_back(const_cast<char*>(word.c_str()));  // execvp does not write to them
  }
  words.push_back(nullptr);
  const std::string output = command.output.string(), errors = command.errors.string();
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child < 0) {
    return fail(ErrorKind::device, fmt::format("{}: no process: {}", command.words[0], std::strerror(errno)));
  }
  if (child > 0) {
    return child;
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  if (::getppid() == parent && ::chdir(command.folder.c_str()) == 0 && redirect("/dev/null", STDIN_FILENO) &&
      redirect(output, STDOUT_FILENO) && redirect(errors, STDERR_FILENO)) {
    ::alarm(command.limit_s);  // stays over exec
    ::execvp(words[0], words.data());
    const std::string complaint = fmt::format("{}: {}\n", words[0], std::strerror(errno));
    static_cast<void>(!::write(STDERR_FILENO, complaint.data(), complaint.size()));
  }
  ::_exit(127);
}

Expected<std::optional<ChildEnd>> ended_child(bool wait) {
  const auto end = wait_for(-1, wait ? 0 : WNOHANG);
  if (!end) {
    return tl::unexpected(end.error());
  }
  return end->child == 0 ? std::nullopt : std::optional(*end);
}

Expected<std::string> answer_of(const std::vector<std::string>& words, const std::filesystem::path& scratch) {
  const std::filesystem::path output = scratch / fmt::format("answer.{}", ::getpid());
  const std::filesystem::path errors = scratch / fmt::format("errors.{}", ::getpid());
  const auto child = start_child({words, scratch, output, errors, answer_limit_s});
  if (!child) {
    return tl::unexpected(child.error());
  }
  const auto end = wait_for(*child, 0);
  auto text = read_text_file(output, longest_answer);
  const std::string complaint = first_line(errors);
  std::error_code ignored;
  std::filesystem::remove(output, ignored);
  std::filesystem::remove(errors, ignored);
  if (!end || !text) {
    return tl::unexpected(end ? text.error() : end.error());
  }
  if (end->exit_status != 0 || end->signal != 0) {
    return fail(ErrorKind::device, fmt::format("{}: {}", words[0],
                                               !complaint.empty() ? complaint
                                               : end->signal != 0 ? fmt::format("no answer within {} s", answer_limit_s)
                                                                  : fmt::format("status {}", end->exit_status)));
  }
  return text;
}

std::string first_line(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

}  // namespace selfcal::batch
