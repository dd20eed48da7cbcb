// selfcal bus log, selfcal bus decode: what goes over the CAN bus, as text.
#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>

#include "protocol/can/bus_log.hpp"
#include "protocol/can/socket.hpp"
#include "protocol/profile/names.hpp"
#include "protocol/uds/decode.hpp"
#include "tools/cli/bus_document.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/device/bus_commands.hpp"

namespace selfcal::cli {
namespace {

struct LogArguments {
  std::string interface;
  std::optional<std::uint64_t> count;
  std::optional<double> seconds;
};

struct DecodeArguments {
  std::string file, profile;
  bool json = false, extended = false;
  std::optional<std::uint32_t> request_id, response_id, functional_id;  // before what the profile says
};

volatile std::sig_atomic_t stop_asked = 0;

// SIGINT and SIGTERM interrupt poll() only: what has been received is still written.
class StopSignals {
 public:
  StopSignals() {
    struct sigaction action {};
    action.sa_handler = [](int) { stop_asked = 1; };
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
    sigset_t both;
    ::sigemptyset(&both);
    ::sigaddset(&both, SIGINT);
    ::sigaddset(&both, SIGTERM);
    ::sigprocmask(SIG_BLOCK, &both, &outside_);  // delivered inside ppoll() alone: none is missed
  }
  const sigset_t* while_waiting() const { return &outside_; }

 private:
  sigset_t outside_{};
};

// True when frames wait, false at the deadline or a signal.
Expected<bool> wait_for_frames(int descriptor, const StopSignals& signals, std::optional<double> seconds_left) {
  pollfd waiting{descriptor, POLLIN, 0};
  timespec timeout{};
  if (seconds_left) {
    const double left = std::max(0.0, *seconds_left);
    timeout.tv_sec = static_cast<time_t>(left);
    timeout.tv_nsec = static_cast<long>((left - static_cast<double>(timeout.tv_sec)) * 1e9);
  }
  const int ready = ::ppoll(&waiting, 1, seconds_left ? &timeout : nullptr, signals.while_waiting());
  if (ready < 0 && errno != EINTR) {
    return fail(ErrorKind::internal, fmt::format("cannot wait for frames: {}", std::strerror(errno)));
  }
  return ready > 0;
}

Expected<int> log_bus(const LogArguments& arguments) {
  can::SocketOptions options;
  options.kernel_time = true;
  options.interface = arguments.interface;
  Expected<can::Socket> socket = can::Socket::open(options);
  if (!socket) {
    return tl::unexpected(socket.error());
  }
  const StopSignals signals;
  const auto begin = std::chrono::steady_clock::now();
  std::array<char, can::max_log_line> buffer{};
  std::uint64_t written = 0;
  while (stop_asked == 0 && (!arguments.count || written < *arguments.count)) {
    std::fflush(stdout);  // what has come is shown before the wait
    std::optional<double> left;
    if (arguments.seconds) {
      left = *arguments.seconds - std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      if (*left <= 0.0) {
        break;
      }
    }
    const Expected<bool> ready = wait_for_frames(socket->fd(), signals, left);
    if (!ready) {
      return tl::unexpected(ready.error());
    }
    if (!*ready) {
      continue;
    }
    const auto received = socket->receive();
    if (!received) {
      return tl::unexpected(received.error());
    }
    for (const can::ReceivedFrame& frame : *received) {
      if (!arguments.count || written < *arguments.count) {
        fmt::print("{}\n", can::format_log_line(frame.kernel_time, arguments.interface, frame.frame,
                                                frame.event.has_value(), buffer));
        ++written;
      }
    }
  }
  if (socket->lost_frames() > 0) {
    fmt::print(stderr, "selfcal bus log: {}: {} frames lost, the reader was too slow\n", arguments.interface,
               socket->lost_frames());
    return 1;
  }
  return 0;
}

double seconds(Time time) { return std::chrono::duration<double>(time).count(); }

Expected<uds::DecoderOptions> decoder_of(const DecodeArguments& arguments) {
  const auto profile = device::chosen_profile(arguments.profile);
  if (!profile) {
    return tl::unexpected(profile.error());
  }
  if (const std::string why = device::cannot_try(**profile); !why.empty()) {
    return fail(ErrorKind::bad_input, why);
  }
  uds::DecoderOptions options = profile::decoder_options(*profile);
  options.request_id = arguments.request_id.value_or(options.request_id);
  options.response_id = arguments.response_id.value_or(options.response_id);
  options.functional_id = arguments.functional_id.value_or(options.functional_id);
  options.extended = options.extended || arguments.extended;
  return options;
}

Expected<int> decode_log(const DecodeArguments& arguments) {
  const auto options = decoder_of(arguments);
  if (!options) {
    return tl::unexpected(options.error());
  }
  std::ifstream file;
  if (arguments.file != "-") {
    file.open(arguments.file);
    if (!file) {
      return fail(ErrorKind::bad_input, fmt::format("{}: cannot open: {}", arguments.file, std::strerror(errno)));
    }
  }
  Expected<document::InputFile> input;
  if (arguments.json && arguments.file != "-") {
    input = document::identify_file(arguments.file);
    if (!input) {
      return tl::unexpected(input.error());
    }
  }
  can::LogReader reader(arguments.file == "-" ? std::cin : file);
  uds::LogDecoder decoder(*options);
  BusDocument answer;
  for (;;) {
    const auto entry = reader.next();
    if (!entry) {
      return fail(entry.error().kind, fmt::format("{}: {}", arguments.file, entry.error().message));
    }
    if (!*entry) {
      break;
    }
    if ((*entry)->error_frame) {
      const std::string_view words = can::name(can::decode_error_frame((*entry)->frame.id, (*entry)->frame.payload()));
      arguments.json ? answer.add_error_frame((*entry)->time, words)
                     : fmt::print("({:.6f}) error frame: {}\n", seconds((*entry)->time), words);
    } else if (const auto decoded = decoder.on_frame((*entry)->frame, (*entry)->time)) {
      arguments.json ? answer.add(*decoded) : fmt::print("{}\n", uds::line(*decoded));
    }
  }
  if (arguments.json) {
    fmt::print("{}\n", answer.text(*input, decoder.malformed()));
  }
  if (decoder.malformed() > 0) {
    fmt::print(stderr, "selfcal bus decode: {}: {} of {} messages malformed\n", arguments.file, decoder.malformed(),
               decoder.messages() + decoder.malformed());
    return 1;
  }
  return 0;
}

CommandRun configure(Options& options) {
  auto log = std::make_shared<LogArguments>();
  auto log_options = std::make_shared<Options>(
      options.command("log", "every frame of the bus, as `candump -L` writes it; until Ctrl-C"));
  log_options->text("INTERFACE", log->interface, "CAN interface, for example can0", Needed::yes);
  log_options->whole("--count", log->count, range::frames, "stop after so many frames");
  log_options->number("--seconds", log->seconds, range::waiting, "stop after so long");
  auto decode = std::make_shared<DecodeArguments>();
  Options decoding = options.command("decode", "UDS messages and status frames of a log, by name");
  decoding.text("LOG", decode->file, "`candump -L` log; - for standard input", Needed::yes);
  decoding.text("--profile", decode->profile, "what the INS speaks, TOML; without it selfcal's own");
  decoding.can_identifier("--request-id", decode->request_id,
                          "CAN identifier, tester to INS, hexadecimal; without it the profile's");
  decoding.can_identifier("--response-id", decode->response_id, "INS to tester, hexadecimal");
  decoding.can_identifier("--functional-id", decode->functional_id, "tester to all, hexadecimal");
  decoding.flag("--json", decode->json, "as JSON");
  decoding.flag("--extended", decode->extended, "these identifiers have 29 bits");
  return [log_options, log, decode] { return log_options->chosen() ? log_bus(*log) : decode_log(*decode); };
}

const CommandRegistration registration{{"bus", "log and decode the CAN bus", configure}};

}  // namespace
}  // namespace selfcal::cli
