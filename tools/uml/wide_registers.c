// Loaded before user-mode Linux where the processor keeps more registers than it knows (AMX: 11,008 bytes, of which Linux 6.1 as a
// user's program writes 2,696). The host takes a process's extended registers as a whole only and refuses the part (EFAULT), and the
// guest dies as it starts. Here the part is laid over what the process has.
#define _GNU_SOURCE
#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#ifndef NT_X86_XSTATE
#define NT_X86_XSTATE 0x202
#endif

enum { widest = 65536, least = 576 };  // bytes; the latter is the legacy part with the header that says what follows

static long set_part(long process, void* registers, const struct iovec* part) {
  static __thread char whole[widest];
  struct iovec all = {whole, sizeof whole};
  if (part->iov_len < least || syscall(SYS_ptrace, PTRACE_GETREGSET, process, registers, &all) != 0 ||
      all.iov_len <= part->iov_len) {
    errno = EFAULT;
    return -1;
  }
  memcpy(whole, part->iov_base, part->iov_len);
  return syscall(SYS_ptrace, PTRACE_SETREGSET, process, registers, &all);
}

// As the C library has it: requests that read a word return it.
long ptrace(enum __ptrace_request request, ...) {
  va_list arguments;
  va_start(arguments, request);
  const long process = va_arg(arguments, int);
  void* address = va_arg(arguments, void*);
  void* data = va_arg(arguments, void*);
  va_end(arguments);
  const int reads = request == PTRACE_PEEKTEXT || request == PTRACE_PEEKDATA || request == PTRACE_PEEKUSER;
  long word = 0;
  const long result = syscall(SYS_ptrace, (long)request, process, address, reads ? (void*)&word : data);
  if (reads) {
    if (result < 0) {
      return -1;
    }
    errno = 0;
    return word;
  }
  const int whole_only = result != 0 && (errno == EFAULT || errno == EINVAL);
  return request == PTRACE_SETREGSET && (long)address == NT_X86_XSTATE && whole_only ? set_part(process, address, data)
                                                                                     : result;
}
