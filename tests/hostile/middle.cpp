#include "tests/hostile/middle.hpp"

#include <algorithm>
#include <chrono>

#include "protocol/byte_order.hpp"
#include "protocol/flash/crc32c.hpp"
#include "protocol/flash/page.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "tests/own_ins/status_frames.hpp"

namespace selfcal::hostile {
namespace {

constexpr std::size_t most_waiting = 256;  // messages and frames; more than that the bus would not have taken
constexpr std::size_t record_at = 3;       // behind service and identifier
constexpr std::size_t block_at = 2;        // behind service and counter
constexpr std::size_t page_crc_at = 32;

isotp::Options turned(isotp::Options link) {
  std::swap(link.address.transmit_id, link.address.receive_id);
  link.address.functional_id.reset();
  return link;
}

isotp::Options alone(isotp::Options link) {
  link.address.functional_id.reset();
  return link;
}

Time time_of(double seconds) { return std::chrono::duration_cast<Time>(std::chrono::duration<double>(seconds)); }

void put_word(std::span<std::uint8_t> place, std::uint32_t word) { ByteWriter(place).put(word); }

void seal_again(Seal seal, uds::Bytes& answer) {
  if (seal == Seal::coefficients && answer.size() >= record_at + ins::coefficients_bytes) {
    const auto record = std::span(answer).subspan(record_at, ins::coefficients_bytes);
    const std::size_t sealed = ins::coefficients_bytes - sizeof(std::uint32_t);
    put_word(record.subspan(sealed), flash::crc32c(record.first(sealed)));
  }
  for (std::size_t at = block_at; seal == Seal::page && at + flash::page_bytes <= answer.size();
       at += flash::page_bytes) {
    const auto page = std::span(answer).subspan(at, flash::page_bytes);
    put_word(page.subspan(page_crc_at), 0);
    put_word(page.subspan(page_crc_at), flash::crc32c(page));
  }
}

bool is_pending(std::span<const std::uint8_t> message) {
  return message.size() == 3 && message[0] == uds::service::negative_response &&
         message[2] == static_cast<std::uint8_t>(uds::Nrc::response_pending);
}

void put_signal(const ins::Signal& signal, std::uint32_t raw, can::CanFrame& frame) {
  for (unsigned bit = 0; bit < signal.bits; ++bit) {
    const unsigned at = signal.start_bit + bit;
    std::uint8_t& byte = frame.data[at / 8];
    byte = static_cast<std::uint8_t>((byte & ~(1U << at % 8)) | (raw >> bit & 1U) << at % 8);
  }
}

}  // namespace

Middle::Middle(const isotp::Options& link, std::vector<Rule> rules, std::function<void()> cut_power)
    : response_id_(link.address.receive_id),
      functional_id_(link.address.functional_id.value_or(0)),
      tester_(turned(link)),
      ins_(alone(link)),
      rules_(std::move(rules)),
      seen_(rules_.size(), 0),
      cut_power_(std::move(cut_power)) {}

bool Middle::acts(std::size_t rule) {
  const std::uint32_t n = ++seen_[rule];
  const bool now = n >= rules_[rule].at && (rules_[rule].times == 0 || n < rules_[rule].at + rules_[rule].times);
  acted_ += now ? 1 : 0;
  return now;
}

void Middle::from_tester(const can::CanFrame& frame, Time now) {
  if (frame.id == functional_id_) {
    frames_to_ins_.push_back(frame);
    return;
  }
  for (const isotp::Result result : tester_.on_frame(frame, now)) {
    if (result == isotp::Result::received) {
      take_request(now);
    }
  }
}

void Middle::from_ins(const can::CanFrame& frame, Time now) {
  if (frame.id != response_id_) {
    pass_status(frame);
    return;
  }
  for (const isotp::Result result : ins_.on_frame(frame, now)) {
    if (result == isotp::Result::received) {
      take_answer(now);
    }
  }
}

void Middle::take_request(Time now) {
  request_.assign(tester_.message().begin(), tester_.message().end());
  active_.clear();
  std::erase_if(items_, [](const Item& item) { return item.part; });
  const Rule* swallowed = nullptr;
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (!rules_[i].matches(request_) || !acts(i)) {
      continue;
    }
    active_.push_back(i);
    if (rules_[i].kind == Kind::swallow) {
      swallowed = &rules_[i];
    } else if (rules_[i].kind == Kind::power_cut && rules_[i].seconds <= 0.0) {
      cut_power_();
    } else if (rules_[i].kind == Kind::power_cut) {
      items_.push_back({now + time_of(rules_[i].seconds), {}, false, 0, Time{0}, true});
    }
  }
  if (swallowed == nullptr) {
    requests_.push_back(request_);
  } else if (!swallowed->bytes.empty()) {
    tell(swallowed->bytes, now, Time{0}, 0, Time{0});
  }
}

void Middle::take_answer(Time now) {
  uds::Bytes answer(ins_.message().begin(), ins_.message().end());
  Time delay{0};
  std::uint32_t copies = 0;
  bool send = true;
  if (!is_pending(answer)) {
    const uds::Bytes as_it_came = answer;
    for (const std::size_t i : active_) {
      send = change(rules_[i], answer, now, delay, copies) && send;
    }
    last_answer_ = as_it_came;
  }
  if (send && !answer.empty()) {
    tell(answer, now, delay, copies, Time{0});
  }
}

bool Middle::change(const Rule& rule, uds::Bytes& answer, Time now, Time& delay, std::uint32_t& copies) {
  const Time seconds = time_of(rule.seconds);
  switch (rule.kind) {
    case Kind::set:
    case Kind::flip:
      for (std::size_t k = 0; k < rule.bytes.size() && rule.offset + k < answer.size(); ++k) {
        std::uint8_t& byte = answer[rule.offset + k];
        byte = rule.kind == Kind::set ? rule.bytes[k] : static_cast<std::uint8_t>(byte ^ rule.bytes[k]);
      }
      seal_again(rule.seal, answer);
      return true;
    case Kind::truncate: answer.resize(std::min<std::size_t>(answer.size(), rule.count)); return true;
    case Kind::append:
      for (std::uint32_t k = 0; k < std::max(1U, std::min(rule.count, 1U << 16U)); ++k) {
        answer.insert(answer.end(), rule.bytes.begin(), rule.bytes.end());
      }
      return true;
    case Kind::replace: answer = rule.bytes; return true;
    case Kind::refuse:
      answer = {uds::service::negative_response, request_[0], static_cast<std::uint8_t>(rule.count)};
      return true;
    case Kind::withhold: return false;
    case Kind::delay: delay += seconds; return true;
    case Kind::repeat: copies += rule.count; return true;
    case Kind::previous: answer = last_answer_; return true;
    case Kind::pending: {
      const auto nrc = static_cast<std::uint8_t>(uds::Nrc::response_pending);
      tell(uds::Bytes{uds::service::negative_response, request_[0], nrc}, now, Time{0}, rule.count, seconds);
      delay += seconds * (std::int64_t{rule.count} + 1);
      return true;
    }
    case Kind::stranger:
    case Kind::frame: tell(rule.bytes, now, Time{0}, rule.count, seconds, rule.kind == Kind::frame); return false;
    case Kind::trickle: trickle(answer, seconds, now); return false;
    default: return true;
  }
}

// Classic frames, whatever the link is: first frame and consecutive ones, without a look at flow control.
void Middle::trickle(View answer, Time every, Time now) {
  constexpr std::size_t in_consecutive = 7;
  if (answer.size() <= in_consecutive) {
    uds::Bytes frame{static_cast<std::uint8_t>(answer.size())};
    frame.insert(frame.end(), answer.begin(), answer.end());
    tell(frame, now, every, 0, Time{0}, true);
    return;
  }
  // ISO 15765-2: a length beyond 4095 stands in 32 bits behind a length of 0.
  const bool long_form = answer.size() > 4095;
  const std::size_t in_first = long_form ? 2 : 6;
  const auto size = static_cast<std::uint32_t>(answer.size());
  uds::Bytes frame{static_cast<std::uint8_t>(0x10U | (long_form ? 0U : size >> 8U)),
                   static_cast<std::uint8_t>(long_form ? 0U : size)};
  if (long_form) {
    frame.resize(6);
    put_word(std::span(frame).subspan(2), size);
  }
  frame.insert(frame.end(), answer.begin(), answer.begin() + static_cast<std::ptrdiff_t>(in_first));
  tell(frame, now, Time{0}, 0, Time{0}, true);
  Time due = every;
  std::uint8_t sequence = 1;
  for (std::size_t at = in_first; at < answer.size(); at += in_consecutive, due += every) {
    const View part = answer.subspan(at, std::min(in_consecutive, answer.size() - at));
    frame = {static_cast<std::uint8_t>(0x20U | sequence++ % 16)};
    frame.insert(frame.end(), part.begin(), part.end());
    tell(frame, now, due, 0, Time{0}, true);
    items_.back().part = true;
  }
}

void Middle::tell(View message, Time now, Time delay, std::uint32_t again, Time every, bool raw) {
  constexpr Time least = std::chrono::milliseconds(1);
  items_.push_back({now + delay, {message.begin(), message.end()}, raw, again, std::max(every, least), false});
}

void Middle::pass_status(const can::CanFrame& frame) {
  can::CanFrame changed = frame;
  std::uint32_t copies = 1;
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    const Rule& rule = rules_[i];
    if (!of_status(rule.kind)) {
      continue;
    }
    const auto signal = std::ranges::find(ins::status_signals, rule.signal, &ins::Signal::name);
    const bool named = signal != ins::status_signals.end();
    if ((named && signal->frame_id != frame.id) || !acts(i)) {
      continue;
    }
    if (rule.kind == Kind::status_off) {
      copies = 0;
    } else if (rule.kind == Kind::status_flood) {
      copies += rule.count;
    } else if (rule.kind == Kind::status_set && named) {
      put_signal(*signal, rule.count, changed);
    } else {
      for (std::size_t k = 0; k < rule.bytes.size() && rule.offset + k < can::max_classic_bytes; ++k) {
        changed.data[rule.offset + k] = rule.bytes[k];
      }
    }
  }
  frames_to_tester_.insert(frames_to_tester_.end(), std::min<std::size_t>(copies, most_waiting), changed);
}

void Middle::on_time(Time now) {
  static_cast<void>(tester_.on_time(now));
  static_cast<void>(ins_.on_time(now));
  for (std::size_t i = 0; i < items_.size();) {
    Item& item = items_[i];
    if (item.due > now) {
      ++i;
      continue;
    }
    if (item.power) {
      cut_power_();
    } else if (item.raw) {
      can::CanFrame frame;
      frame.id = response_id_;
      frame.size = static_cast<std::uint8_t>(std::min(item.bytes.size(), can::max_classic_bytes));
      std::copy_n(item.bytes.begin(), frame.size, frame.data.begin());
      frames_to_tester_.push_back(frame);
    } else if (messages_.size() < most_waiting) {
      messages_.push_back(item.bytes);
    }
    if (item.again > 0) {
      --item.again;
      item.due = now + item.every;
      ++i;
    } else {
      items_.erase(items_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  flush(now);
}

void Middle::flush(Time now) {
  while (!messages_.empty() && !tester_.sending()) {
    static_cast<void>(tester_.send(messages_.front(), now));  // one that is too long for the link is lost
    messages_.pop_front();
  }
  while (!requests_.empty() && !ins_.sending()) {
    static_cast<void>(ins_.send(requests_.front(), now));
    requests_.pop_front();
  }
}

void Middle::take(std::vector<can::CanFrame>& to_tester, std::vector<can::CanFrame>& to_ins, Time now) {
  on_time(now);
  const auto drain = [now](isotp::Transport& transport, std::vector<can::CanFrame>& out) {
    std::array<can::CanFrame, 64> frames;
    for (std::size_t n = transport.pending(frames, now); n > 0; n = transport.pending(frames, now)) {
      out.insert(out.end(), frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(n));
      static_cast<void>(transport.sent(n, now));
    }
  };
  to_tester.insert(to_tester.end(), frames_to_tester_.begin(), frames_to_tester_.end());
  to_ins.insert(to_ins.end(), frames_to_ins_.begin(), frames_to_ins_.end());
  frames_to_tester_.clear();
  frames_to_ins_.clear();
  drain(tester_, to_tester);
  drain(ins_, to_ins);
}

std::optional<Time> Middle::next_deadline() const {
  std::optional<Time> earliest;
  const auto consider = [&earliest](std::optional<Time> t) {
    if (t && (!earliest || *t < *earliest)) {
      earliest = t;
    }
  };
  consider(tester_.next_deadline());
  consider(ins_.next_deadline());
  for (const Item& item : items_) {
    consider(item.due);
  }
  return earliest;
}

}  // namespace selfcal::hostile
