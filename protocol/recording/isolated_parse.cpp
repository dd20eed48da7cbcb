#include "protocol/recording/isolated_parse.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

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

[[noreturn]] void run_child(int descriptor, const std::string& name,
                            const std::function<Expected<Recording>()>& parse) {
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
    handed_over = write_bytes(descriptor, parse());
  } catch (const std::bad_alloc&) {
    handed_over = write_bytes(descriptor, fail(ErrorKind::bad_input, name + ": does not fit into memory"));
  }
  ::_exit(handed_over ? 0 : 1);
}

}  // namespace

Expected<Recording> parse_isolated(const std::string& name, const std::function<Expected<Recording>()>& parse) {
  const SharedMemory memory;
  const pid_t child = memory.descriptor < 0 ? -1 : ::fork();
  if (child < 0) {
    return fail(ErrorKind::internal,
                fmt::format("{}: cannot start a process to read it: {}", name, std::strerror(errno)));
  }
  if (child == 0) {
    run_child(memory.descriptor, name, parse);
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
  return read_bytes(memory.descriptor);
}

}  // namespace selfcal
