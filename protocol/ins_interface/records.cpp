#include "protocol/ins_interface/records.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>

#include "protocol/byte_order.hpp"
#include "protocol/flash/page.hpp"

namespace selfcal::ins {
namespace {

constexpr std::int32_t full_turn_mdeg = 360'000;
constexpr double half_way_round_m = 2.1e7;        // the Earth: no two places are farther apart
constexpr double longest_check_s = 4294967295.0;  // 32 bits of seconds can be asked for

template <typename... Fields>
Bytes pack(const Fields&... fields) {
  Bytes bytes((sizeof(Fields) + ...));
  ByteWriter out(bytes);
  (out.put(fields), ...);
  return bytes;
}

tl::unexpected<Error> wrong(std::string_view record, std::string_view field, const auto& value) {
  return fail(ErrorKind::bad_input, fmt::format("{} record: {} is {}", record, field, value));
}

Expected<void> check_length(std::string_view record, ByteView bytes, std::size_t wanted) {
  if (bytes.size() != wanted) {
    return fail(ErrorKind::bad_input, fmt::format("{} record: {} bytes instead of {}", record, bytes.size(), wanted));
  }
  return {};
}

template <typename R>
Expected<R> checked(const R& record) {
  const auto well = check(record);
  return well ? Expected<R>(record) : tl::unexpected(well.error());
}

struct FieldRange {
  std::string_view field;
  double value, least, most;
};

// Rates: from one sample in two seconds, at which a rotation is hardly seen, to beyond the fastest inertial sensors.
// Scales: a count below the noise of any sensor by orders of magnitude would overflow 32 bits within a sample at full
// rate, or be coarser than a whole calibration.
std::array<FieldRange, 6> sample_format_ranges(const SampleFormatRecord& r) {
  return {{{"sample rate in Hz", r.sample_rate_hz, 0.5, 20e3},
           {"angle per count in rad", r.delta_theta_lsb_rad, 1e-13, 1e-3},
           {"velocity per count in m/s", r.delta_v_lsb_mps, 1e-11, 1e-1},
           {"gimbal angle per count in rad", r.gimbal_lsb_rad, 1e-9, 0.1},
           {"bytes of a page", static_cast<double>(r.page_bytes), flash::page_bytes, flash::page_bytes},
           {"samples of a page", static_cast<double>(r.samples_per_page), 1.0, flash::samples_per_page}}};
}

}  // namespace

// Written so that NaN fails too.
Expected<void> check(const StateRecord& r) {
  constexpr double two_turns_deg = 720.0;
  for (const double angle : {r.outer_deg, r.inner_deg}) {
    if (!(std::abs(angle) <= two_turns_deg)) {
      return wrong("state", "gimbal angle in degrees", angle);
    }
  }
  return {};
}

Expected<void> check(const MoveRecord& r) {
  for (const std::int32_t angle : {r.outer_mdeg, r.inner_mdeg}) {
    if (angle < -full_turn_mdeg || angle > full_turn_mdeg) {
      return wrong("move", "angle in millidegrees", angle);
    }
  }
  return {};
}

Expected<void> check(const ScheduleRecord& r) {
  if (r.positions.empty() || r.positions.size() > max_positions) {
    return wrong("schedule", "number of positions", r.positions.size());
  }
  for (std::size_t i = 0; i < r.positions.size(); ++i) {
    for (const std::int32_t angle : {r.positions[i].outer_mdeg, r.positions[i].inner_mdeg}) {
      if (angle < -full_turn_mdeg || angle > full_turn_mdeg) {
        return wrong("schedule", fmt::format("angle of position {} in millidegrees", i + 1), angle);
      }
    }
  }
  return {};
}

Bytes encode(const SiteRecord& r) { return pack(r.latitude_deg, r.longitude_deg, r.height_m); }

Expected<SiteRecord> decode_site(ByteView bytes) {
  if (const auto length = check_length("site", bytes, 24); !length) {
    return tl::unexpected(length.error());
  }
  ByteReader in(bytes);
  SiteRecord r;
  r.latitude_deg = in.get_double();
  r.longitude_deg = in.get_double();
  r.height_m = in.get_double();
  return checked(r);
}

Expected<void> check(const SiteRecord& r) {
  // Written so that NaN fails too.
  if (!(std::abs(r.latitude_deg) <= 90.0)) {
    return wrong("site", "latitude", r.latitude_deg);
  }
  if (!(std::abs(r.longitude_deg) <= 360.0)) {
    return wrong("site", "longitude", r.longitude_deg);
  }
  if (!(r.height_m >= -1000.0 && r.height_m <= 20000.0)) {
    return wrong("site", "height in m", r.height_m);
  }
  return {};
}

Expected<void> check(const DirectoryRecord& r) {
  if (r.first_page > r.pages_written) {
    return wrong("directory", fmt::format("first page beyond the {} written; it", r.pages_written), r.first_page);
  }
  if (r.pages_written == 0 && r.samples != 0) {
    return wrong("directory", "number of samples in no page", r.samples);
  }
  return {};
}

Bytes encode(const SampleFormatRecord& r) {
  return pack(r.sample_rate_hz, r.delta_theta_lsb_rad, r.delta_v_lsb_mps, r.gimbal_lsb_rad, r.page_bytes,
              r.samples_per_page);
}

Expected<SampleFormatRecord> decode_sample_format(ByteView bytes) {
  if (const auto length = check_length("sample format", bytes, 38); !length) {
    return tl::unexpected(length.error());
  }
  ByteReader in(bytes);
  SampleFormatRecord r;
  r.sample_rate_hz = in.get_double();
  r.delta_theta_lsb_rad = in.get_double();
  r.delta_v_lsb_mps = in.get_double();
  r.gimbal_lsb_rad = in.get_double();
  r.page_bytes = in.get<std::uint32_t>();
  r.samples_per_page = in.get<std::uint16_t>();
  return checked(r);
}

Expected<void> check(const SampleFormatRecord& r) {
  for (const auto& [field, value, least, most] : sample_format_ranges(r)) {
    if (!(value >= least && value <= most)) {  // written so that NaN fails too
      return fail(ErrorKind::bad_input, fmt::format("sample format record: {} is {:g}, must lie between {:g} and {:g}",
                                                    field, value, least, most));
    }
  }
  return {};
}

Expected<void> check(const NavigationCheckRecord& r) {
  struct Quantity {
    std::string_view name;
    double value;
    double least, most;
  };
  for (const auto& [name, value, least, most] :
       {Quantity{"time passed in s", r.elapsed_s, 0.0, longest_check_s},
        Quantity{"distance north in m", r.north_m, -half_way_round_m, half_way_round_m},
        Quantity{"distance east in m", r.east_m, -half_way_round_m, half_way_round_m},
        Quantity{"largest distance in m", r.max_horizontal_m, 0.0, half_way_round_m}}) {
    if (!(value >= least && value <= most)) {  // written so that NaN fails too
      return fail(ErrorKind::bad_input, fmt::format("navigation check record: {} is {}, must lie between {:g} and {:g}",
                                                    name, value, least, most));
    }
  }
  return {};
}

}  // namespace selfcal::ins
