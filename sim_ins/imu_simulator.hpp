// The IMU: true motion through sensor errors, concealed physics, noise and quantisation, one sample after another.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "protocol/error.hpp"
#include "sim_ins/config.hpp"
#include "sim_ins/law.hpp"
#include "sim_ins/noise_spectrum.hpp"
#include "sim_ins/physics.hpp"
#include "sim_ins/random.hpp"
#include "sim_ins/sensor_physics.hpp"
#include "sim_ins/true_motion.hpp"
#include "sim_ins/turn_memory.hpp"

namespace selfcal::sim {

// One interval of 1/sample_rate. Increments are counts of the configured LSBs.
struct ImuSample {
  std::array<std::int32_t, 3> delta_theta{};
  std::array<std::int32_t, 3> delta_v{};
  double outer = 0.0;  // rad, read-outs at the interval's end
  double inner = 0.0;
  double temperature_c = 0.0;  // read-out
  bool missing = false;        // lost on the way to the memory
};

// Exact integrals of output over one interval, before noise: what noise-free, unquantised sensors would give.
struct IdealIncrement {
  Vector3 delta_theta = Vector3::Zero();  // rad
  Vector3 delta_v = Vector3::Zero();      // m/s
};

class ImuSimulator {
 public:
  // Fails with bad_input on a configuration out of range or an effect whose values do not fit its description.
  [[nodiscard]] static Expected<ImuSimulator> create(const SimConfig& config, GimbalMotion gimbal, std::uint64_t seed,
                                                     const ConcealedPhysics& physics);

  ImuSample next();

  // Output integrated over [begin, end]: Gauss-Legendre, three nodes a piece while the gimbal turns, two while only
  // the base moves, pieces cut at the corners of the gimbal's profile. Bound, at 50 Hz and 30 deg/s: the integrand's
  // sixth derivative is below 10 g (0.6 rad/s)^6, its integral's error below 1e-17 m/s; the kink of max(f, 0) where an
  // axis passes level costs at most K g (0.6 rad/s) h^2 / 8 = 1e-8 m/s for K = 1e-4 once, 1e-3 of the noise.
  IdealIncrement integrate(double begin, double end);

  const TrueMotion& motion() const { return motion_; }

 private:
  struct ActiveEffect {
    SensorEquation equation = nullptr;
    std::vector<double> values;
  };
  struct ActiveLaw {
    Law law;
    std::vector<LawEvaluator> evaluator;  // none for a process
    std::vector<double> jumps;            // of turn k
    double walk = 0.0;
    Random random;
  };
  struct ActiveMemory {
    bool gyro = false;
    Matrix3 gain;  // rad/s or m/s^2 per unit of the memory
    TurnMemory memory;
  };
  struct Line {  // spectral line on the sensors' output
    Vector3 domega, df;
    double angular_frequency = 0.0;
    double phase = 0.0;
  };
  struct Loss {
    double start_s, count, every_s, mode;
  };
  struct Quantiser {  // counts of lsb; what does not fill a count is carried on
    double lsb = 1.0;
    Vector3 carried = Vector3::Zero();
    std::array<std::int64_t, 3> count(const Vector3& increment);
  };

  ImuSimulator(const SimConfig& config, TrueMotion motion, const SensorErrors& errors, std::uint64_t seed);
  void take(const PhysicsEffect& effect);
  [[nodiscard]] Expected<void> take(const Law& law, std::uint64_t seed);
  void prepare_turns();
  void prepare_laws();
  LawVariables law_variables_at(double t, const MotionState& state) const;
  void add_laws(double t, const MotionState& state, SensorDeviation& deviation);
  void add_law_noise(IdealIncrement& increment, double h);
  SensorContext context_at(double t, const MotionState& state) const;
  MotionState state_at(double t);
  IdealIncrement output_at(double t);
  void add_noise(IdealIncrement& increment, double begin, double end);
  bool lose(ImuSample& sample, double begin);

  SimConfig config_;
  TrueMotion motion_;
  SensorErrors errors_;
  Random gyro_noise_, accel_noise_, instability_, readout_, integral_;
  std::vector<ActiveEffect> effects_;
  std::vector<ActiveLaw> laws_;
  std::vector<ActiveMemory> memories_;
  std::vector<std::array<double, 2>> senses_;  // of the axes after k turns have begun
  double mean_temperature_c_ = 0.0;
  // A bias that wanders and comes back: Gauss-Markov, first order.
  struct Wander {
    bool gyro = false;
    Vector3 sigma;  // rad/s or m/s^2
    double tau_s = 0.0;
    Vector3 value;
  };
  Wander wander(bool gyro, const Vector3& sigma, double tau_s);
  std::vector<Wander> wanders_;
  std::vector<Line> lines_;
  std::vector<SpectrumNoise> spectra_;
  std::vector<Loss> losses_;
  std::vector<Vector3> turn_df_;  // per move
  bool needs_angular_acceleration_ = false;
  double accel_delay_s_ = 0.0;
  double clock_scale_ = 0.0;
  Vector3 gyro_arw_ = Vector3::Zero();       // rad/sqrt(s)
  Vector3 accel_vrw_ = Vector3::Zero();      // m/s/sqrt(s)
  Vector3 gyro_walk_asd_ = Vector3::Zero();  // rad/s/sqrt(s)
  Vector3 accel_walk_asd_ = Vector3::Zero();
  Vector3 gyro_walk_ = Vector3::Zero();   // rad/s
  Vector3 accel_walk_ = Vector3::Zero();  // m/s^2
  // White noise of the integrals: what dither leaves.
  Vector3 angle_sigma_ = Vector3::Zero(), velocity_sigma_ = Vector3::Zero();    // rad, m/s
  Vector3 angle_before_ = Vector3::Zero(), velocity_before_ = Vector3::Zero();  // at the end of the sample before
  Quantiser gyro_hidden_{0.0}, accel_hidden_{0.0};  // concealed coarser quantisation; lsb 0: none
  Quantiser gyro_quantiser_, accel_quantiser_;
  std::uint64_t index_ = 0;
  ImuSample before_;
  int cached_move_ = -2;  // dwell whose state is cached, -2: none
  MotionState cached_state_;
};

}  // namespace selfcal::sim
