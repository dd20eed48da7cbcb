#include "sim_ins/imu_simulator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/geometry/units.hpp"
#include "sim_ins/sensor_errors.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::sim {
namespace {

// Streams of the seed; true_sensor_errors() and simulate() take others.
constexpr std::uint64_t gyro_noise_stream = 11;
constexpr std::uint64_t accel_noise_stream = 12;
constexpr std::uint64_t instability_stream = 13;
constexpr std::uint64_t readout_stream = 14;
constexpr std::uint64_t integral_stream = 15;

Vector3 normal3(Random& random) {
  const double x = random.normal();
  const double y = random.normal();
  return {x, y, random.normal()};
}

std::int32_t clamped(std::int64_t count) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(count, std::numeric_limits<std::int32_t>::min(),
                                                            std::numeric_limits<std::int32_t>::max()));
}

void add_base_effect(BaseMotion& base, const PhysicsEffect& effect) {
  const auto value = [&effect](std::string_view name) { return value_of(effect, name); };
  if (effect.id == "base_sway") {
    const std::array<std::pair<std::string_view, std::vector<Sine>*>, 6> axes{{{"roll", &base.roll},
                                                                               {"pitch", &base.pitch},
                                                                               {"yaw", &base.yaw},
                                                                               {"surge", &base.surge},
                                                                               {"heave", &base.heave},
                                                                               {"sway", &base.sway}}};
    for (const auto& [name, sines] : axes) {
      if (value(name) != 0.0) {
        sines->push_back({value(name), value("period_s"), value("phase")});
      }
    }
  } else if (effect.id == "base_settling") {
    base.settling_roll.push_back({value("roll"), value("tau_s")});
    base.settling_pitch.push_back({value("pitch"), value("tau_s")});
    base.settling_heave.push_back({value("heave"), value("tau_s")});
    base.settling_surge.push_back({value("surge"), value("tau_s")});
    base.settling_sway.push_back({value("sway"), value("tau_s")});
  }
}

Expected<void> check_effect(const PhysicsEffect& effect) {
  for (const EffectDescription& known : physics_effects()) {
    if (known.id == effect.id) {
      if (known.parameters.size() != effect.values.size()) {
        return fail(ErrorKind::bad_input, fmt::format("physics: {} has {} values, {} needed", effect.id,
                                                      effect.values.size(), known.parameters.size()));
      }
      return {};
    }
  }
  return fail(ErrorKind::bad_input, fmt::format("physics: no effect is called {}", effect.id));
}

}  // namespace

std::array<std::int64_t, 3> ImuSimulator::Quantiser::count(const Vector3& increment) {
  carried += increment;
  std::array<std::int64_t, 3> counts{};
  for (std::size_t i = 0; i < 3; ++i) {
    double& rest = carried[static_cast<int>(i)];
    counts[i] = std::llround(rest / lsb);
    rest -= static_cast<double>(counts[i]) * lsb;
  }
  return counts;
}

Expected<ImuSimulator> ImuSimulator::create(const SimConfig& config, GimbalMotion gimbal, std::uint64_t seed,
                                            const ConcealedPhysics& physics) {
  if (const auto sound = check_config(config); !sound) {
    return tl::unexpected(sound.error());
  }
  const auto errors = true_sensor_errors(config, seed);
  if (!errors) {
    return tl::unexpected(errors.error());
  }
  BaseMotion base = config.base_motion;
  for (const PhysicsEffect& effect : physics.effects) {
    if (const auto sound = check_effect(effect); !sound) {
      return tl::unexpected(sound.error());
    }
    add_base_effect(base, effect);
  }
  for (const NoiseSpectrum& spectrum : physics.spectra) {
    constexpr double most = 0x1p23;  // half a gigabyte to draw
    if (const double samples = repeats_after(spectrum, config.sample_rate_hz); samples > most) {
      return fail(ErrorKind::bad_input,
                  fmt::format("physics: the loudness of a spectrum makes {:.3g} samples, at most {:.3g} are drawn",
                              samples, most));
    }
    if (of_base(spectrum)) {
      add_tilt(spectrum, seed, base);
    }
  }
  const earth::Position site{config.latitude_deg * units::degree, config.longitude_deg * units::degree,
                             config.height_m};
  const Attitude mean{config.roll_deg * units::degree, config.pitch_deg * units::degree,
                      config.heading_deg * units::degree};
  ImuSimulator imu(config, TrueMotion(site, mean, std::move(base), std::move(gimbal)), *errors, seed);
  for (const PhysicsEffect& effect : physics.effects) {
    imu.take(effect);
  }
  for (const NoiseSpectrum& spectrum : physics.spectra) {
    if (!of_base(spectrum)) {
      imu.spectra_.emplace_back(spectrum, config.sample_rate_hz, seed);
    }
  }
  imu.prepare_turns();
  imu.prepare_laws();
  for (const Law& law : physics.laws) {
    if (const auto taken = imu.take(law, seed); !taken) {
      return tl::unexpected(taken.error());
    }
  }
  return imu;
}

ImuSimulator::ImuSimulator(const SimConfig& config, TrueMotion motion, const SensorErrors& errors, std::uint64_t seed)
    : config_(config),
      motion_(std::move(motion)),
      errors_(errors),
      gyro_noise_(seed, gyro_noise_stream),
      accel_noise_(seed, accel_noise_stream),
      instability_(seed, instability_stream),
      readout_(seed, readout_stream),
      integral_(seed, integral_stream) {
  gyro_arw_.setConstant(config.gyro_arw_deg_per_sqrt_h * units::degree_per_sqrt_hour);
  accel_vrw_.setConstant(config.accel_vrw_ug_per_sqrt_hz * units::micro_g_per_sqrt_hz);
  gyro_quantiser_.lsb = config.gyro_lsb_arcsec * units::arcsecond;
  accel_quantiser_.lsb = config.accel_lsb_m_per_s;
  const double of_gyros = config.gyro_bias_instability_deg_per_h * units::degree_per_hour;
  const double of_accelerometers = config.accel_bias_instability_ug * units::micro_g;
  wanders_ = {wander(true, Vector3::Constant(of_gyros), config.bias_instability_tau_s),
              wander(false, Vector3::Constant(of_accelerometers), config.bias_instability_tau_s)};
  if (of_gyros == 0.0 && of_accelerometers == 0.0) {
    wanders_.clear();
  }
}

void ImuSimulator::take(const PhysicsEffect& effect) {
  const std::vector<double>& v = effect.values;
  const auto axes = [&v](std::size_t first) { return Vector3(v[first], v[first + 1], v[first + 2]); };
  const auto more = [&](Vector3& asd) { asd = (asd.cwiseAbs2() + axes(0).cwiseAbs2()).cwiseSqrt(); };
  if (const SensorEquation equation = sensor_equation(effect.id)) {
    effects_.push_back({equation, v});
    needs_angular_acceleration_ |= sim::needs_angular_acceleration(effect.id);
  } else if (effect.id == "accel_load_lag" || effect.id == "gyro_load_lag") {
    memories_.push_back({effect.id.starts_with("gyro"), matrix_of(v), TurnMemory(TurnMemory::Of::load, v[9])});
  } else if (effect.id == "accel_turn_heat" || effect.id == "gyro_turn_heat") {
    Matrix3 per_rad = Matrix3::Zero();
    per_rad.col(0) = axes(0);
    memories_.push_back({effect.id.starts_with("gyro"), per_rad, TurnMemory(TurnMemory::Of::travel, v[3])});
  } else if (effect.id == "accel_gyro_time_offset") {
    accel_delay_s_ += v[0];
  } else if (effect.id == "gyro_noise_level") {
    more(gyro_arw_);
  } else if (effect.id == "accel_noise_level") {
    more(accel_vrw_);
  } else if (effect.id == "gyro_random_walk") {
    more(gyro_walk_asd_);
  } else if (effect.id == "accel_random_walk") {
    more(accel_walk_asd_);
  } else if (effect.id == "gyro_bias_instability" || effect.id == "accel_bias_instability") {
    wanders_.push_back(wander(effect.id.starts_with("gyro"), axes(0), v[3]));
  } else if (effect.id == "quantisation") {
    gyro_hidden_.lsb = std::max(gyro_hidden_.lsb, v[0]);  // one entry may be the gyros', another the accelerometers'
    accel_hidden_.lsb = std::max(accel_hidden_.lsb, v[1]);
  } else if (effect.id == "integral_noise") {
    angle_sigma_ = (angle_sigma_.cwiseAbs2() + axes(0).cwiseAbs2()).cwiseSqrt();
    velocity_sigma_ = (velocity_sigma_.cwiseAbs2() + axes(3).cwiseAbs2()).cwiseSqrt();
  } else if (effect.id == "vibration_line") {
    lines_.push_back({axes(0), axes(3), 2.0 * std::numbers::pi * v[6], v[7]});
  } else if (effect.id == "lost_samples") {
    losses_.push_back({v[0], v[1], v[2], v[3]});
  } else if (effect.id == "time_base") {
    clock_scale_ += v[0];
  }  // what is left acts on the base, which has it already
}

// Stationary from the start.
ImuSimulator::Wander ImuSimulator::wander(bool gyro, const Vector3& sigma, double tau_s) {
  return {gyro, sigma, tau_s, sigma.cwiseProduct(normal3(instability_))};
}

void ImuSimulator::prepare_turns() {
  for (const GimbalMove& move : motion_.gimbal().moves()) {
    turn_df_.push_back(motion_.at(move.end_s()).f_ib_b - motion_.at(move.start_s).f_ib_b);
  }
}

MotionState ImuSimulator::state_at(double t) {
  const GimbalMotion& gimbal = motion_.gimbal();
  if (!motion_.base_still() || gimbal.turning(t, t)) {
    return motion_.at(t);
  }
  const int move = gimbal.last_move(t);  // a still base and a resting gimbal: one state for the whole dwell
  if (move != cached_move_) {
    cached_state_ = motion_.at(t);
    cached_move_ = move;
  }
  return cached_state_;
}

SensorContext ImuSimulator::context_at(double t, const MotionState& state) const {
  const GimbalMotion& gimbal = motion_.gimbal();
  SensorContext context;
  context.t = t;
  context.C_nb = state.C_nb;
  context.f_ib_b = state.f_ib_b;
  context.omega_ib_b = state.omega_ib_b;
  context.temperature = &config_.temperature;
  context.since_turn_s = gimbal.since_move_end(t);
  int ended = gimbal.last_move(t);
  if (ended >= 0 && gimbal.turning(t, t)) {
    --ended;
  }
  if (ended >= 0) {
    context.turn_df = turn_df_[static_cast<std::size_t>(ended)];
  }
  const GimbalState angles = gimbal.at(t);
  context.outer = angles.angle[0];
  context.inner = angles.angle[1];
  if (needs_angular_acceleration_ && (!motion_.base_still() || gimbal.turning(t, t))) {
    context.angular_acceleration = motion_.angular_acceleration(t);
  }
  return context;
}

IdealIncrement ImuSimulator::output_at(double t) {
  MotionState state = state_at(t);
  if (accel_delay_s_ != 0.0) {
    state.f_ib_b = state_at(t - accel_delay_s_).f_ib_b;
  }
  SensorDeviation deviation{accel_error(errors_, state.f_ib_b), gyro_error(errors_, state.omega_ib_b)};
  if (!effects_.empty()) {
    const SensorContext context = context_at(t, state);
    for (const ActiveEffect& effect : effects_) {
      effect.equation(effect.values, context, deviation);
    }
  }
  for (ActiveMemory& active : memories_) {
    (active.gyro ? deviation.domega : deviation.df) += active.gain * active.memory.at(t, motion_);
  }
  if (!laws_.empty()) {
    add_laws(t, state, deviation);
  }
  return {state.omega_ib_b + deviation.domega, state.f_ib_b + deviation.df};
}

IdealIncrement ImuSimulator::integrate(double begin, double end) {
  // Gauss-Legendre nodes and weights on [-1, 1]: Abramowitz & Stegun, table 25.4.
  static const double node3 = std::sqrt(0.6);
  static const double node2 = 1.0 / std::sqrt(3.0);
  const GimbalMotion& gimbal = motion_.gimbal();
  const bool constant = motion_.base_still() && effects_.empty() && laws_.empty() && memories_.empty();
  const bool turning = gimbal.turning(begin - std::abs(accel_delay_s_), end + std::abs(accel_delay_s_));
  IdealIncrement sum;
  const auto add = [&](double t, double weight) {
    const IdealIncrement rate = output_at(t);
    sum.delta_theta += weight * rate.delta_theta;
    sum.delta_v += weight * rate.delta_v;
  };
  const auto piece = [&](double a, double b) {
    const double middle = 0.5 * (a + b);
    const double half = 0.5 * (b - a);
    if (turning) {
      add(middle - half * node3, half * 5.0 / 9.0);
      add(middle, half * 8.0 / 9.0);
      add(middle + half * node3, half * 5.0 / 9.0);
    } else if (constant) {
      add(middle, 2.0 * half);
    } else {
      add(middle - half * node2, half);
      add(middle + half * node2, half);
    }
  };
  double from = begin;
  if (turning) {
    const std::vector<double>& corners = gimbal.breakpoints();
    for (auto c = std::upper_bound(corners.begin(), corners.end(), begin); c != corners.end() && *c < end; ++c) {
      piece(from, *c);
      from = *c;
    }
  }
  piece(from, end);
  return sum;
}

void ImuSimulator::add_noise(IdealIncrement& increment, double begin, double end) {
  const double h = end - begin;
  const double root_h = std::sqrt(h);
  for (const Line& line : lines_) {
    const double w = line.angular_frequency;
    const double integral = (std::cos(w * begin + line.phase) - std::cos(w * end + line.phase)) / w;
    increment.delta_theta += line.domega * integral;
    increment.delta_v += line.df * integral;
  }
  Vector3 gyro = gyro_walk_, accel = accel_walk_;
  for (const Wander& w : wanders_) {
    (w.gyro ? gyro : accel) += w.value;
  }
  increment.delta_theta += h * gyro + root_h * gyro_arw_.cwiseProduct(normal3(gyro_noise_));
  increment.delta_v += h * accel + root_h * accel_vrw_.cwiseProduct(normal3(accel_noise_));
  if (!gyro_walk_asd_.isZero(0.0) || !accel_walk_asd_.isZero(0.0)) {
    gyro_walk_ += root_h * gyro_walk_asd_.cwiseProduct(normal3(instability_));
    accel_walk_ += root_h * accel_walk_asd_.cwiseProduct(normal3(instability_));
  }
  for (Wander& w : wanders_) {
    const double keep = std::exp(-h / w.tau_s);
    w.value = keep * w.value + std::sqrt(1.0 - keep * keep) * w.sigma.cwiseProduct(normal3(instability_));
  }
  if (!angle_sigma_.isZero(0.0) || !velocity_sigma_.isZero(0.0)) {
    const Vector3 angle = angle_sigma_.cwiseProduct(normal3(integral_));
    const Vector3 velocity = velocity_sigma_.cwiseProduct(normal3(integral_));
    increment.delta_theta += angle - angle_before_;
    increment.delta_v += velocity - velocity_before_;
    angle_before_ = angle;
    velocity_before_ = velocity;
  }
  for (SpectrumNoise& noise : spectra_) {
    const int axis = noise.axis();
    (axis < 3 ? increment.delta_theta : increment.delta_v)[axis % 3] += h * noise.next();
  }
  add_law_noise(increment, h);
}

bool ImuSimulator::lose(ImuSample& sample, double begin) {
  for (const Loss& loss : losses_) {
    const double since = begin - loss.start_s;
    const double cycle = since < 0.0 || loss.every_s <= 0.0 ? since : std::fmod(since, loss.every_s);
    // Half a sample of tolerance: begin is k/rate, rounded.
    const double place = cycle * config_.sample_rate_hz + 0.5;
    if (since + 0.5 / config_.sample_rate_hz < 0.0 || place < 0.0 || place >= loss.count + 0.5) {
      continue;
    }
    if (loss.mode == 2.0) {
      sample.missing = true;
    } else {
      sample.delta_theta = loss.mode == 1.0 ? before_.delta_theta : std::array<std::int32_t, 3>{};
      sample.delta_v = loss.mode == 1.0 ? before_.delta_v : std::array<std::int32_t, 3>{};
    }
    return true;
  }
  return false;
}

ImuSample ImuSimulator::next() {
  // The INS counts 1/rate a sample by its own clock; concealed, that clock may run wrong.
  const double h = (1.0 + clock_scale_) / config_.sample_rate_hz;
  const double begin = static_cast<double>(index_) * h;
  const double end = static_cast<double>(index_ + 1) * h;
  ++index_;
  IdealIncrement increment = integrate(begin, end);
  add_noise(increment, begin, end);
  const auto coarse = [](Quantiser& hidden, Vector3& value) {
    if (hidden.lsb > 0.0) {
      const auto counts = hidden.count(value);
      for (int i = 0; i < 3; ++i) {
        value[i] = static_cast<double>(counts[static_cast<std::size_t>(i)]) * hidden.lsb;
      }
    }
  };
  coarse(gyro_hidden_, increment.delta_theta);
  coarse(accel_hidden_, increment.delta_v);

  ImuSample sample;
  const auto theta = gyro_quantiser_.count(increment.delta_theta);
  const auto velocity = accel_quantiser_.count(increment.delta_v);
  for (std::size_t i = 0; i < 3; ++i) {
    sample.delta_theta[i] = clamped(theta[i]);
    sample.delta_v[i] = clamped(velocity[i]);
  }
  const GimbalState angles = motion_.gimbal().at(end);
  const double readout_noise = config_.gimbal.readout_noise_arcsec * units::arcsecond;
  sample.outer = angles.angle[0] + readout_noise * readout_.normal();
  sample.inner = angles.angle[1] + readout_noise * readout_.normal();
  sample.temperature_c =
      temperature_at(config_.temperature, end) + config_.temperature.readout_noise_c * readout_.normal();
  if (!lose(sample, begin)) {
    before_ = sample;
  }
  return sample;
}

}  // namespace selfcal::sim
