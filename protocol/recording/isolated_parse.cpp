#include "protocol/recording/isolated_parse.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <new>

#include "protocol/recording/recording_bytes.hpp"

namespace selfcal {
namespace {

constexpr rlim_t processor_seconds = 120;

struct SharedMemory {
  SharedMemory() : descriptor(::memfd_create("recording", MFD_CLOEXEC)) {}
  ~SharedMemory() {
    if (descriptor >= 0) {
      ::close(descriptor);
    }
  }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;
  int descriptor;
};

// What a child does: its result into the descriptor, or the error. Whether that went well.
using Work = std::function<bool(int descriptor)>;
using Refusal = std::function<bool(int descriptor, Error error)>;

// Whoever asked is gone: nobody wants the answer, and what this process inherited (locks among it) must be free again.
void end_with(pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) {
    ::_exit(1);
  }
}

[[noreturn]] void run_child(int descriptor, const std::string& name, const Work& work, const Refusal& refuse) {
  // Death by signal is an answer here: no handler of the caller's, no core file, no words of its own.
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGINT, SIGTERM}) {
    std::signal(signal, SIG_DFL);
  }
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const rlimit processor{processor_seconds, processor_seconds};
  ::setrlimit(RLIMIT_CPU, &processor);
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  ::dup2(nowhere, STDERR_FILENO);
  bool handed_over = false;
  try {
    handed_over = work(descriptor);
  } catch (const std::bad_alloc&) {
    handed_over = refuse(descriptor, {ErrorKind::bad_input, name + ": does not fit into memory"});
  }
  ::_exit(handed_over ? 0 : 1);
}

// Runs WORK in a child and waits for its end.
Expected<void> run_isolated(const SharedMemory& memory, const std::string& name, const Work& work,
                            const Refusal& refuse) {
  const pid_t parent = ::getpid();
  const pid_t child = memory.descriptor < 0 ? -1 : ::fork();
  if (child < 0) {
    return fail(ErrorKind::internal,
                fmt::format("{}: cannot start a process to read it: {}", name, std::strerror(errno)));
  }
  if (child == 0) {
    end_with(parent);
    run_child(memory.descriptor, name, work, refuse);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) {
      return fail(ErrorKind::internal,
                  fmt::format("{}: lost the process that reads it: {}", name, std::strerror(errno)));
    }
  }
  if (WIFSIGNALED(status)) {
    return fail(ErrorKind::bad_input, fmt::format("{}: damaged: its reader died of signal {} ({})", name,
                                                  WTERMSIG(status), ::strsignal(WTERMSIG(status))));
  }
  if (WEXITSTATUS(status) != 0) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: damaged: its reader ended with status {}", name, WEXITSTATUS(status)));
  }
  ::lseek(memory.descriptor, 0, SEEK_SET);
  return {};
}

// One byte that says which, then the text.
bool write_text(int descriptor, const Expected<std::string>& text) {
  std::string all(1, text ? '1' : '0');
  all += text ? *text : text.error().message;
  std::string_view rest = all;
  while (!rest.empty()) {
    const ssize_t written = ::write(descriptor, rest.data(), rest.size());
    if (written < 0 && errno != EINTR) {
      return false;
    }
    rest.remove_prefix(written < 0 ? 0 : static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

Expected<Recording> parse_isolated(const std::string& name, const std::function<Expected<Recording>()>& parse) {
  const SharedMemory memory;
  const auto run = run_isolated(
      memory, name, [&parse](int descriptor) { return write_bytes(descriptor, parse()); },
      [](int descriptor, Error error) { return write_bytes(descriptor, tl::unexpected(std::move(error))); });
  if (!run) {
    return tl::unexpected(run.error());
  }
  return read_bytes(memory.descriptor);
}

Expected<std::string> bytes_isolated(const std::string& name, const std::function<Expected<std::string>()>& parse) {
  const SharedMemory memory;
  const auto run = run_isolated(
      memory, name, [&parse](int descriptor) { return write_text(descriptor, parse()); },
      [](int descriptor, Error error) { return write_text(descriptor, tl::unexpected(std::move(error))); });
  if (!run) {
    return tl::unexpected(run.error());
  }
  std::string all;
  std::array<char, 65536> block{};
  for (ssize_t count = 1; count != 0;) {
    count = ::read(memory.descriptor, block.data(), block.size());
    if (count < 0 && errno != EINTR) {
      return fail(ErrorKind::internal,
                  fmt::format("{}: cannot take over what was read: {}", name, std::strerror(errno)));
    }
    all.append(block.data(), count > 0 ? static_cast<std::size_t>(count) : 0);
  }
  if (!all.starts_with('1')) {
    return fail(ErrorKind::bad_input, all.substr(std::min<std::size_t>(1, all.size())));
  }
  all.erase(0, 1);
  return all;
}

}  // namespace selfcal
