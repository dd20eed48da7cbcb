// The INS behind its UDS server without a socket, on a clock that the test sets: frames in, frames out, power on and off.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "protocol/uds/server.hpp"
#include "sim_ins/device/diagnostics.hpp"
#include "sim_ins/device/instrument.hpp"
#include "tests/own_ins/identifiers.hpp"

namespace selfcal::sim {

class VirtualUnit {
 public:
  VirtualUnit(const SimConfig& config, FlashMemory flash, const DiagnosticOptions& diagnostics)
      : config_(config), diagnostic_options_(diagnostics) {
    link_.address = {ins::can_id::response, ins::can_id::request, ins::can_id::functional, false};
    // What fits into a block fits into a message.
    link_.max_message = diagnostic_options_.longest_response;
    link_.fd = link_.max_message > 4095;
    link_.frame_bytes = link_.fd ? can::max_fd_bytes : can::max_classic_bytes;
    boot(std::move(flash));
  }

  // Nothing but what the FLASH had done comes over. Throws PowerLost where the supply gives out meanwhile.
  void power_on(Time now) {
    instrument_->flash().cut_power(seconds(now));
    boot(std::move(instrument_->flash()));
    start(now);
  }

  bool accepts(const can::CanFrame& frame) const { return server_->accepts(frame); }
  void on_frame(const can::CanFrame& frame, Time now) {
    if (instrument_->ready()) {  // nobody listens while the INS starts
      server_->on_frame(frame, now);
    }
  }
  // Everything that is due; also the reset that was asked for, once its answer is out.
  void step(Time now) {
    server_->run_session_timer(diagnostics_->session_timer_wanted(), now);
    server_->on_time(now);
    diagnostics_->set_instrument_time(seconds(now));
    instrument_->advance(seconds(now));
    if (const auto answer = diagnostics_->take_answer()) {
      server_->respond(*answer, now);
    }
    reset_pending_ = diagnostics_->take_reset_request() || reset_pending_;
    if (reset_pending_ && server_->idle()) {
      start(now);
    }
  }
  std::size_t pending(std::span<can::CanFrame> out, Time now) const { return server_->pending(out, now); }
  void sent(std::size_t count, Time now) { server_->sent(count, now); }

  Instrument& instrument() { return *instrument_; }
  Diagnostics& diagnostics() { return *diagnostics_; }
  uds::Server& server() { return *server_; }
  FlashMemory& flash() { return instrument_->flash(); }

 private:
  static double seconds(Time t) { return std::chrono::duration<double>(t).count(); }

  void boot(FlashMemory flash) {
    flash.lose_power_after(std::nullopt);
    auto created = Instrument::create(config_, 1, {}, std::move(flash), {});
    server_.reset();
    diagnostics_.reset();
    instrument_ = std::move(created.value());
    diagnostics_.emplace(*instrument_, diagnostic_options_);
    server_.emplace(link_, uds::ServerTimings{}, *diagnostics_);
  }
  void start(Time now) {
    reset_pending_ = false;
    instrument_->power_on(seconds(now));
    diagnostics_->power_on(now);
    server_->reset();
  }

  SimConfig config_;
  DiagnosticOptions diagnostic_options_;
  isotp::Options link_;
  std::unique_ptr<Instrument> instrument_;
  std::optional<Diagnostics> diagnostics_;
  std::optional<uds::Server> server_;
  bool reset_pending_ = false;
};

}  // namespace selfcal::sim
