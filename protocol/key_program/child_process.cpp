#include "protocol/key_program/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <linux/close_range.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <thread>
#include <utility>

namespace selfcal {
namespace {

constexpr uid_t nobody = 65534;
constexpr int report_to = 3;  // the child's fourth descriptor, closed by becoming the program
constexpr rlim_t most_memory = rlim_t{1} << 30U;
constexpr rlim_t most_descriptors = 32;

// Of a pipe: both ends, each closed where it is not handed on.
struct Pipe {
  Pipe() {
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
      ends = {-1, -1};
    }
  }
  ~Pipe() {
    close(0);
    close(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close(std::size_t which) {
    if (ends[which] >= 0) {
      ::close(std::exchange(ends[which], -1));
    }
  }
  int hand_on(std::size_t which) {
    ::fcntl(ends[which], F_SETFL, O_NONBLOCK);
    return std::exchange(ends[which], -1);
  }
  bool there() const { return ends[0] >= 0; }
  std::array<int, 2> ends{-1, -1};
};

// Never more than the caller itself has.
bool limit(int what, rlim_t most) {
  const auto resource = static_cast<__rlimit_resource>(what);
  rlimit now{};
  if (::getrlimit(resource, &now) != 0) {
    return false;
  }
  const rlim_t least = now.rlim_max < most ? now.rlim_max : most;
  const rlimit both{least, least};
  return ::setrlimit(resource, &both) == 0;
}

// Between fork and exec only what is safe there: system calls, no memory. What failed is in errno.
bool give_up_privileges(unsigned processor_s) {
  if (::geteuid() == 0 && (::setgroups(0, nullptr) != 0 || ::setresgid(nobody, nobody, nobody) != 0 ||
                           ::setresuid(nobody, nobody, nobody) != 0)) {
    return false;
  }
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && ::prctl(PR_SET_PDEATHSIG, SIGKILL) == 0 &&
         limit(RLIMIT_CORE, 0) && limit(RLIMIT_FSIZE, 0) && limit(RLIMIT_NPROC, 0) && limit(RLIMIT_AS, most_memory) &&
         limit(RLIMIT_CPU, processor_s) && limit(RLIMIT_NOFILE, most_descriptors);
}

void default_signals() {
  for (int signal = 1; signal < NSIG; ++signal) {
    ::signal(signal, SIG_DFL);
  }
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
}

[[noreturn]] void become(const char* file, char* const* words, unsigned processor_s, const Pipe& input,
                         const Pipe& output, const Pipe& error, const Pipe& report) {
  char path[] = "PATH=/usr/bin:/bin", language[] = "LANG=C.UTF-8";
  char* const environment[] = {path, language, nullptr};
  if (::dup2(input.ends[0], 0) == 0 && ::dup2(output.ends[1], 1) == 1 && ::dup2(error.ends[1], 2) == 2 &&
      ::dup2(report.ends[1], report_to) == report_to && ::fcntl(report_to, F_SETFD, FD_CLOEXEC) == 0 &&
      ::syscall(SYS_close_range, report_to + 1, ~0U, 0) == 0 && ::setsid() >= 0 && ::chdir("/") == 0 &&
      give_up_privileges(processor_s)) {
    ::umask(077);
    default_signals();
    ::execve(file, words, environment);
  }
  const int why = errno;
  static_cast<void>(!::write(report_to, &why, sizeof why));
  ::_exit(127);
}

// Whether there may be more later.
bool drain(int& descriptor, std::string& into, std::size_t most, bool& too_long) {
  std::array<char, 4096> block{};
  constexpr int blocks_at_once = 64;  // so that one that writes for ever holds up nobody
  for (int k = 0; descriptor >= 0 && k < blocks_at_once; ++k) {
    const ssize_t count = ::read(descriptor, block.data(), block.size());
    if (count < 0) {
      return errno == EAGAIN || errno == EINTR;
    }
    if (count == 0) {
      ::close(std::exchange(descriptor, -1));
      return false;
    }
    const std::size_t room = most - into.size();
    too_long = too_long || static_cast<std::size_t>(count) > room;
    into.append(block.data(), std::min(static_cast<std::size_t>(count), room));
  }
  return descriptor >= 0;
}

}  // namespace

Expected<std::unique_ptr<ChildProcess>> ChildProcess::start(const ChildOrder& order) {
  std::unique_ptr<ChildProcess> child(new ChildProcess);
  child->order_ = order;
  std::string file = order.file, argument = order.argument.value_or("");
  char* const words[] = {file.data(), order.argument ? argument.data() : nullptr, nullptr};
  Pipe input, output, error, report;
  // Before there is a reader: a pipe holds far more than a seed, and nobody can close its other end yet.
  if (!input.there() || !output.there() || !error.there() || !report.there() ||
      ::write(input.ends[1], order.input.data(), order.input.size()) != static_cast<ssize_t>(order.input.size())) {
    return fail(ErrorKind::device, fmt::format("no pipe to it: {}", std::strerror(errno)));
  }
  child->pid_ = ::fork();
  if (child->pid_ < 0) {
    return fail(ErrorKind::device, fmt::format("no process for it: {}", std::strerror(errno)));
  }
  if (child->pid_ == 0) {
    become(file.c_str(), words, order.processor_s, input, output, error, report);
  }
  child->from_output_ = output.hand_on(0);
  child->from_error_ = error.hand_on(0);
  child->begun_ = report.hand_on(0);
  return child;
}

ChildProcess::~ChildProcess() {
  kill();
  for (const int descriptor : {begun_, from_output_, from_error_}) {
    if (descriptor >= 0) {
      ::close(descriptor);
    }
  }
}

void ChildProcess::take_streams() {
  bool ignored = false;
  std::string why;
  drain(begun_, why, sizeof(int), ignored);
  if (why.size() == sizeof(int)) {
    int number = 0;
    std::memcpy(&number, why.data(), sizeof number);
    not_begun_ = std::strerror(number);
  }
  drain(from_output_, output_, order_.most_output, output_too_long_);
  drain(from_error_, message_, order_.most_message, ignored);
}

std::optional<int> ChildProcess::look() {
  if (!status_) {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_) {
      status_ = status;
    }
    take_streams();
  }
  return status_;
}

// A process that is in the middle of a system call ends a little later: it is waited for, and not for long.
void ChildProcess::kill() {
  constexpr int looks = 50;
  if (status_) {
    return;
  }
  ::kill(-pid_, SIGKILL);  // its group, once it has its session
  ::kill(pid_, SIGKILL);
  for (int look = 0; look < looks && !status_; ++look) {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_) {
      status_ = status;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
}

}  // namespace selfcal
