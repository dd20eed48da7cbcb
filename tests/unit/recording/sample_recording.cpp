#include "tests/unit/recording/sample_recording.hpp"

#include <stdlib.h>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include "estimator/geometry/rotation.hpp"

namespace selfcal::test {
namespace {

constexpr double dwell_s = 6.0;
constexpr double move_s = 3.0;
constexpr double quarter_turn = std::numbers::pi / 2.0;

// 0 to 1 over a move, with rests at both ends.
double share(double seconds) {
  if (seconds <= 0.0) {
    return 0.0;
  }
  if (seconds >= move_s) {
    return 1.0;
  }
  return 0.5 - 0.5 * std::cos(std::numbers::pi * seconds / move_s);
}

double outer_at(double t) { return quarter_turn * share(t - dwell_s); }
double inner_at(double t) { return quarter_turn * share(t - 2.0 * dwell_s - move_s); }

std::array<double, 3> as_array(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

Recording sample_recording() {
  Recording recording;
  recording.serial = "TEST-1";
  recording.sample_rate_hz = sample_rate_hz;
  recording.latitude_deg = 40.0;
  recording.longitude_deg = 116.0;
  recording.height_m = 50.0;
  recording.dwell_s = dwell_s;
  recording.rotation_s = move_s;
  recording.start_time_utc = "2024-02-03T04:05:06Z";
  recording.schedule_deg = {{0, 0}, {90, 0}, {90, 90}};
  recording.temperature_channels = 2;
  const auto rows = static_cast<std::size_t>((3.0 * dwell_s + 2.0 * move_s) * sample_rate_hz);
  Matrix3 C_vb_before = Matrix3::Identity();
  for (std::size_t row = 0; row < rows; ++row) {
    const double t = static_cast<double>(row + 1) / sample_rate_hz;
    const Matrix3 C_vb = gimbal_matrix(outer_at(t), inner_at(t));
    recording.time_s.push_back(t);
    recording.delta_theta_rad.push_back(as_array(rotation_vector_from_matrix(C_vb_before.transpose() * C_vb)));
    recording.delta_v_mps.push_back(as_array(C_vb.transpose() * Vector3(0.0, 9.8017 / sample_rate_hz, 0.0)));
    recording.gimbal_outer_rad.push_back(outer_at(t));
    recording.gimbal_inner_rad.push_back(inner_at(t));
    recording.temperature_c.push_back(25.0 + 0.001 * t);
    recording.temperature_c.push_back(26.0 + 0.002 * t);
    C_vb_before = C_vb;
  }
  return recording;
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "selfcal-test-XXXXXX").string();
  path_ = ::mkdtemp(name.data());
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path shared_recordings() {
  const char* shared = std::getenv("SELFCAL_SHARED");
  const std::filesystem::path folder =
      std::filesystem::path(shared != nullptr ? shared : SELFCAL_SOURCE_DIR "/../shared") / "recordings";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

}  // namespace selfcal::test
