#include "tools/cli/device/conformance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "protocol/uds/messages.hpp"

namespace selfcal::cli::device {
namespace {

// Long enough for an answer that must not come.
constexpr double silence_s = 0.25;
// Sessions in a row that were not answered: one answer may be lost, and one that is seconds late is waited for each time.
constexpr int most_unanswered = 3;

std::string codes_text(std::initializer_list<uds::Nrc> codes) {
  std::string text = "7F, the service, ";
  std::string_view between;
  for (const uds::Nrc code : codes) {
    text += fmt::format("{}{}", between, uds::describe_nrc(static_cast<std::uint8_t>(code)));
    between = " or ";
  }
  return text;
}

}  // namespace

std::string_view name(Verdict verdict) {
  switch (verdict) {
    case Verdict::holds: return "holds";
    case Verdict::fails: return "fails";
    default: return "not tried";
  }
}

std::string words(const Exchange& exchange) {
  switch (exchange.kind) {
    case Exchange::Kind::silent: return "nothing";
    case Exchange::Kind::broken: return exchange.why;
    case Exchange::Kind::negative:
      return fmt::format("{}: {}", hex(exchange.response), uds::describe_nrc(exchange.nrc));
    default: return hex(exchange.response);
  }
}

Expected<Bytes> Conformance::key_to(const Bytes& seed) const {
  if (profile_.security.program) {
    return key_by_program(*profile_.security.program, seed);
  }
  return uds::answer_seed(*permission_.key, seed).map([](const auto& key) { return Bytes(key.begin(), key.end()); });
}

bool Conformance::unlock() {
  if (!profile_.security.needed) {
    return true;
  }
  if (!permission_.key) {
    why_not_ = "needs --key-file";
    return false;
  }
  const std::uint8_t level = profile_.security.level;
  const Exchange seed = tester_.ask(uds::seed_request(level));
  const auto bytes = uds::read_seed_response(seed.response, level, profile_.security.seed_bytes);
  if (seed.kind != Exchange::Kind::positive || !bytes) {
    why_not_ = fmt::format("no seed: {}", words(seed));
    return false;
  }
  if (std::ranges::all_of(*bytes, [](std::uint8_t b) { return b == 0; })) {
    return true;
  }
  const auto key = key_to(*bytes);
  if (!key) {
    why_not_ = key.error().message;
    return false;
  }
  const Exchange opened = tester_.ask(uds::key_request(*key, level));
  if (opened.kind != Exchange::Kind::positive) {
    why_not_ = fmt::format("the lock does not open: {}", words(opened));
    return false;
  }
  return true;
}

bool Conformance::enter(Mode mode) {
  if (unanswered_ >= most_unanswered) {
    why_not_ = fmt::format("the INS fell silent after {}", answered_last_);
    return false;
  }
  const auto session = mode == Mode::standard ? uds::Session::standard : static_cast<uds::Session>(profile_.session);
  const Exchange entered = tester_.ask(uds::session_request(session));
  unanswered_ = entered.kind == Exchange::Kind::silent ? unanswered_ + 1 : 0;
  if (entered.kind != Exchange::Kind::positive) {
    why_not_ = fmt::format("session {:02X} is not entered: {}", static_cast<unsigned>(session), words(entered));
    return false;
  }
  return mode != Mode::open || unlock();
}

bool Conformance::ready(const Requirement& requirement) {
  if (tester_.trouble()) {
    return false;
  }
  if (requirement.writes && !permission_.write) {
    not_tried(requirement, "needs --write");
    return false;
  }
  if (!enter(requirement.mode)) {
    not_tried(requirement, why_not_);
    return false;
  }
  answered_last_ = requirement.id;
  return true;
}

void Conformance::judged(const Requirement& requirement, std::string sent, std::string expected, std::string came,
                         bool holds) {
  results_.push_back({std::string(requirement.id), std::string(requirement.clause), std::string(requirement.words),
                      std::move(sent), std::move(expected), std::move(came), holds ? Verdict::holds : Verdict::fails});
}

void Conformance::not_tried(const Requirement& requirement, std::string why) {
  results_.push_back({std::string(requirement.id), std::string(requirement.clause), std::string(requirement.words), "",
                      "", std::move(why), Verdict::not_tried});
}

bool Conformance::refused(const Requirement& requirement, ByteView request, std::initializer_list<uds::Nrc> codes) {
  if (!ready(requirement)) {
    return false;
  }
  const Exchange exchange = tester_.ask(request);
  const bool holds = exchange.kind == Exchange::Kind::negative && std::ranges::any_of(codes, [&](uds::Nrc code) {
                       return static_cast<std::uint8_t>(code) == exchange.nrc;
                     });
  judged(requirement, hex(request), codes_text(codes), words(exchange), holds);
  return holds;
}

std::optional<Bytes> Conformance::answered(const Requirement& requirement, ByteView request, std::size_t repeated,
                                           const Judge& judge) {
  if (!ready(requirement)) {
    return std::nullopt;
  }
  const Exchange exchange = tester_.ask(request);
  Bytes begin(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(1 + repeated));
  begin[0] = static_cast<std::uint8_t>(begin[0] + uds::positive_offset);
  const bool begins = exchange.kind == Exchange::Kind::positive && exchange.response.size() >= begin.size() &&
                      std::equal(begin.begin(), begin.end(), exchange.response.begin());
  const std::string fault = begins && judge ? judge(exchange.response) : std::string();
  judged(requirement, hex(request), fmt::format("{} and what belongs to it", hex(begin)),
         fault.empty() ? words(exchange) : fmt::format("{}: {}", words(exchange), fault), begins && fault.empty());
  return begins && fault.empty() ? std::optional(exchange.response) : std::nullopt;
}

void Conformance::silent(const Requirement& requirement, ByteView request, bool to_all) {
  if (!ready(requirement)) {
    return;
  }
  tester_.put_single(request, to_all);
  const Exchange exchange = tester_.receive(request[0], silence_s);
  judged(requirement, hex(request) + (to_all ? ", to all nodes" : ""), "nothing", words(exchange),
         exchange.kind == Exchange::Kind::silent);
}

void Conformance::judge_lateness() {
  constexpr Requirement requirement{"timing.p2", "ISO 14229-2, P2_Server and P2*_Server",
                                    "An answer, or response-pending before it, begins in time."};
  const std::string expected =
      fmt::format("within {:g} s, after 0x78 within {:g} s", tester_.p2_s(), tester_.p2_star_s());
  if (tester_.late().empty()) {
    return judged(requirement, "every request", expected, "in time", true);
  }
  const auto worst = std::ranges::max_element(tester_.late(), {}, &Tester::Late::seconds);
  judged(requirement, hex(worst->request), expected,
         fmt::format("after {:.2f} s ({} late altogether)", worst->seconds, tester_.late().size()), false);
}

void Conformance::judge_frames() {
  constexpr Requirement requirement{
      "isotp.frames", "ISO 15765-2, 9.6",
      "Every frame is a single frame, a first frame, a consecutive frame or flow control."};
  const auto& bad = tester_.bad_frames();
  judged(requirement, "every request", "frames that hold what their first bytes tell",
         bad.empty() ? fmt::format("{} frames", tester_.frames())
                     : fmt::format("{} of {} are none, the first: {}", bad.size(), tester_.frames(), hex(bad.front())),
         bad.empty());
}

Expected<std::vector<Result>> Conformance::run() {
  const Exchange present = tester_.ask(uds::tester_present_request(false));
  if (!tester_.trouble() && present.kind == Exchange::Kind::silent) {
    return fail(ErrorKind::device, fmt::format("{}: no answer to TesterPresent from an INS that speaks {}",
                                               tester_.interface(), profile_.name));
  }
  for (const auto group :
       {try_sessions, try_transport, try_records, try_security, try_routines, try_raw_data, try_writing}) {
    group(*this);
  }
  enter(Mode::standard);
  if (tester_.trouble()) {
    return tl::unexpected(*tester_.trouble());
  }
  judge_lateness();
  judge_frames();
  return std::move(results_);
}

}  // namespace selfcal::cli::device
