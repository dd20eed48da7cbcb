// Whether an INS does what its profile, ISO 14229-1 and ISO 15765-2 ask of it, as far as this software relies on it: each
// requirement tried, with what was sent, what was expected and what came.
//
// The gimbal is never turned and no set is put in force. What writes, restarts or sends a wrong key is tried only where `write`
// allows it, and leaves the schedule that was tried and an erased inactive slot.
#pragma once

#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "protocol/uds/security.hpp"
#include "protocol/uds/services.hpp"
#include "tools/cli/device/tester.hpp"

namespace selfcal::cli::device {

enum class Verdict : std::uint8_t { holds, fails, not_tried };
std::string_view name(Verdict verdict);

struct Result {
  std::string id;           // "session.expires"
  std::string clause;       // of the standard, or the profile's section
  std::string requirement;  // one sentence
  std::string sent, expected, came;
  Verdict verdict = Verdict::not_tried;
};

struct Permission {
  bool write = false;
  std::optional<uds::SecurityKey> key;
};

// Where the INS is before a request: in the default session, in the profile's one, or that and the lock open.
enum class Mode : std::uint8_t { standard, session, open };

struct Requirement {
  std::string_view id, clause, words;
  Mode mode = Mode::standard;
  bool writes = false;
};

class Conformance {
 public:
  Conformance(Tester& tester, const profile::Profile& profile, const Permission& permission)
      : tester_(tester), profile_(profile), permission_(permission) {}

  // Fails (device) where the INS does not answer at all, or the bus does not work.
  [[nodiscard]] Expected<std::vector<Result>> run();

  // What the trials are made of. Each brings the INS into the requirement's mode first; where that cannot be, or is not
  // allowed, the requirement is not tried, and they say so by false or nothing.
  bool ready(const Requirement& requirement);
  bool refused(const Requirement& requirement, ByteView request, std::initializer_list<uds::Nrc> codes);
  // The positive response, where it begins as it must and `judge` finds no fault.
  using Judge = std::function<std::string(ByteView response)>;  // what is wrong; empty: nothing
  std::optional<Bytes> answered(const Requirement& requirement, ByteView request, std::size_t repeated,
                                const Judge& judge = {});
  void silent(const Requirement& requirement, ByteView request, bool to_all);
  // Where more than one request was needed.
  void judged(const Requirement& requirement, std::string sent, std::string expected, std::string came, bool holds);
  void not_tried(const Requirement& requirement, std::string why);

  // False: why_not() says why. An INS that answered several sessions in a row with nothing is not asked again.
  bool enter(Mode mode);
  const std::string& why_not() const { return why_not_; }
  bool unlock();
  Expected<Bytes> key_to(const Bytes& seed) const;
  Tester& tester() { return tester_; }
  const profile::Profile& profile() const { return profile_; }
  const Permission& permission() const { return permission_; }

 private:
  void judge_lateness();
  void judge_frames();

  Tester& tester_;
  const profile::Profile& profile_;
  Permission permission_;
  std::vector<Result> results_;
  std::string why_not_;
  int unanswered_ = 0;         // sessions in a row
  std::string answered_last_;  // requirement whose session was entered
};

std::string words(const Exchange& exchange);

// One group each.
void try_transport(Conformance& c);
void try_sessions(Conformance& c);
void try_records(Conformance& c);
void try_security(Conformance& c);
void try_routines(Conformance& c);
void try_raw_data(Conformance& c);
void try_writing(Conformance& c);

}  // namespace selfcal::cli::device
