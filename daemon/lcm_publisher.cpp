#include "daemon/lcm_publisher.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <lcm/lcm-cpp.hpp>
#include <selfcal_lcm/alarm.hpp>
#include <selfcal_lcm/estimate.hpp>
#include <selfcal_lcm/ins_status.hpp>
#include <selfcal_lcm/service_status.hpp>

#include "daemon/host/journal.hpp"
#include "daemon/host/wall_clock.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr auto retry_interval = 10s;
constexpr std::int32_t schema = 1;
constexpr std::int32_t estimate_schema = 2;
constexpr std::int32_t ins_schema = 2;
constexpr std::string_view software_version = SELFCAL_VERSION;

// Whether the kernel knows a way to the group of udpm://GROUP:PORT?…; true for any other provider.
bool has_route(const std::string& url) {
  constexpr std::string_view scheme = "udpm://";
  if (!url.starts_with(scheme)) {
    return true;
  }
  const std::string group = url.substr(scheme.size(), url.find_first_of(":?", scheme.size()) - scheme.size());
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(1);  // connecting a datagram socket sends nothing
  if (inet_pton(AF_INET, group.c_str(), &address.sin_addr) != 1) {
    return true;
  }
  const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) {
    return true;
  }
  const bool reached = connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(descriptor);
  return reached;
}

}  // namespace

LcmPublisher::LcmPublisher(Timers& timers, std::string url)
    : timers_(timers), url_(std::move(url)), started_(timers.now()) {}

LcmPublisher::~LcmPublisher() = default;

void LcmPublisher::open() {
  tried_ = true;
  tried_at_ = timers_.now();
  if (!has_route(url_)) {
    return;  // LCM would write a page of advice for each attempt
  }
  lcm_ = std::make_unique<lcm::LCM>(url_);
  if (lcm_->good()) {
    return;
  }
  lcm_.reset();
}

template <typename Message>
void LcmPublisher::publish(const std::string& channel, const Message& message) {
  if (url_.empty()) {
    return;
  }
  if (!lcm_ && (!tried_ || timers_.now() - tried_at_ >= retry_interval)) {
    open();
  }
  const bool sent = lcm_ && lcm_->publish(channel, &message) == 0;
  if (!sent) {
    lcm_.reset();
  }
  if (sent == !down_said_) {
    return;
  }
  down_said_ = !sent;
  journal::write(journal::Level::warning, sent ? fmt::format("LCM: publishing on {} again", url_)
                                               : fmt::format("LCM: nothing can be published on {} (no route?); "
                                                             "calibration goes on without it",
                                                             url_));
}

void LcmPublisher::publish_service(int instruments, int runs_in_progress) {
  selfcal_lcm::service_status message;
  message.schema = schema;
  message.utime_us = utc_now_us();
  message.software = software_version;
  message.instruments = instruments;
  message.runs_in_progress = runs_in_progress;
  message.uptime_s = std::chrono::duration<double>(timers_.now() - started_).count();
  publish("SELFCAL_SERVICE", message);
}

void LcmPublisher::publish_ins(const PublishedIns& ins) {
  static const RunProgress nothing;
  const RunProgress& progress = ins.progress == nullptr ? nothing : *ins.progress;
  selfcal_lcm::ins_status message;
  message.schema = ins_schema;
  message.utime_us = utc_now_us();
  message.ins = ins.name;
  message.serial = ins.serial;
  message.state = ins.state_idle ? "idle" : std::string(name(progress.state));
  message.run = progress.run;
  message.link_up = progress.link_up;
  message.outer_deg = progress.ins.outer_deg;
  message.inner_deg = progress.ins.inner_deg;
  message.position = progress.ins.position;
  message.positions = progress.positions;
  message.time_left_s = progress.ins.time_left_s;
  message.pages_pulled = static_cast<std::int32_t>(progress.pages_pulled);
  message.pages_written = static_cast<std::int32_t>(progress.ins.pages_written);
  message.pages_expected = static_cast<std::int32_t>(progress.pages_expected);
  message.lost_frames = static_cast<std::int64_t>(progress.lost_frames);
  message.verdict = progress.summary.verdict;
  publish("SELFCAL_INS_" + ins.name, message);
}

void LcmPublisher::publish_estimate(const PublishedIns& ins) {
  if (ins.progress == nullptr || !ins.progress->estimate_known) {
    return;
  }
  const RunProgress& progress = *ins.progress;
  selfcal_lcm::estimate message;
  message.schema = estimate_schema;
  message.utime_us = utc_now_us();
  message.ins = ins.name;
  message.run = progress.run;
  message.pass_number = progress.pass;
  message.pass_fraction = progress.pass_fraction;
  message.count = sensor_parameter_count;
  for (const SensorParameter& parameter : sensor_parameters) {
    message.name.emplace_back(parameter.name);
    message.unit.emplace_back(parameter.unit);
  }
  message.value.assign(progress.value.begin(), progress.value.end());
  message.sigma.assign(progress.sigma.begin(), progress.sigma.end());
  message.tolerance.assign(progress.tolerance.begin(), progress.tolerance.end());
  message.tolerances_met = progress.tolerances_met;
  message.running = progress.running ? 1 : 0;
  message.data_s = progress.data_s;
  message.met_at_s = progress.met_at_s;
  message.finish_in_s = progress.finish_in_s;
  publish("SELFCAL_ESTIMATE_" + ins.name, message);
}

void LcmPublisher::publish_alarm(const std::string& ins, RunId run, bool standing, const std::string& text) {
  selfcal_lcm::alarm message;
  message.schema = schema;
  message.utime_us = utc_now_us();
  message.ins = ins;
  message.run = run;
  message.standing = standing;
  message.text = text;
  publish("SELFCAL_ALARM", message);
}

}  // namespace selfcal
