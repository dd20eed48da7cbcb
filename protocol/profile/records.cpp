#include "protocol/profile/records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocol/profile/gimbal_axes.hpp"

namespace selfcal::profile {
namespace {

// A number of a record: told by the INS, else given by the profile, else as the record begins.
template <typename T>
void take(const Values& values, const Record& record, std::string_view name, T& into) {
  if (values.has(name)) {
    into = static_cast<T>(values.number(name));
  } else if (const auto given = record.given.find(name); given != record.given.end()) {
    into = static_cast<T>(given->second);
  }
}

template <typename T>
Expected<void> take_whole(const Values& values, const Record& record, std::string_view name, T& into) {
  long double value = static_cast<long double>(into);
  take(values, record, name, value);
  value = std::round(value);
  if (!(value >= static_cast<long double>(std::numeric_limits<T>::min()) &&
        value <= static_cast<long double>(std::numeric_limits<T>::max()))) {
    return fail(ErrorKind::bad_input,
                fmt::format("{} record: {} is {:g}", record.layout.record, name, static_cast<double>(value)));
  }
  into = static_cast<T>(value);
  return {};
}

template <typename T>
T element(const Values& values, std::string_view name, std::size_t k) {
  return static_cast<T>(std::round(values.numbers.find(name)->second[k]));
}

const Record none{};

// A gimbal read-out that the INS tells as an angle is kept as binary counts of a turn.
constexpr double gimbal_count_rad = 2.0 * 3.14159265358979323846 / flash::counts_per_turn;

template <typename T, typename... Fields>
Expected<void> take_all(const Values& values, const Record& record, std::string_view name, T& into, Fields&&... more) {
  if (auto taken = take_whole(values, record, name, into); !taken) {
    return taken;
  }
  if constexpr (sizeof...(more) > 0) {
    return take_all(values, record, std::forward<Fields>(more)...);
  } else {
    return {};
  }
}

void put(Values& values, std::string_view name, long double number) {
  values.numbers[std::string(name)].push_back(number);
}

template <typename R>
Expected<R> checked(Expected<void> taken, const R& record) {
  if constexpr (requires { ins::check(record); }) {
    if (taken) {
      taken = ins::check(record);
    }
  }
  return taken ? Expected<R>(record) : tl::unexpected(taken.error());
}

}  // namespace

Expected<Bytes> encode(const Profile& profile, const ins::StateRecord& r) {
  Values v;
  put(v, "state", static_cast<long double>(r.state));
  put(v, "faults", r.faults);
  put(v, "in_force", static_cast<long double>(r.in_force));
  put(v, "coefficients_version", r.coefficients_version);
  put(v, "coefficients_crc", r.coefficients_crc);
  put(v, "run_id", r.run_id);
  put(v, "power_cycles", r.power_cycles);
  put(v, "gimbal_moving", r.moving ? 1 : 0);
  const auto theirs = in_their_axes<double>(profile, {r.outer_deg, r.inner_deg});
  put(v, "outer", theirs[0]);
  put(v, "inner", theirs[1]);
  return write_fields(profile.state.layout, v);
}

Expected<ins::StateRecord> decode_state(const Profile& profile, ByteView bytes) {
  const auto v = read_fields(profile.state.layout, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  ins::StateRecord r;
  r.state = static_cast<ins::State>(v->number("state"));
  r.in_force = static_cast<ins::Slot>(v->number("in_force"));
  r.moving = v->number("gimbal_moving") != 0;
  const auto ours =
      in_our_axes<double>(profile, {static_cast<double>(v->number("outer")), static_cast<double>(v->number("inner"))});
  r.outer_deg = ours[0];
  r.inner_deg = ours[1];
  return checked(take_all(*v, profile.state, "faults", r.faults, "coefficients_version", r.coefficients_version,
                          "coefficients_crc", r.coefficients_crc, "run_id", r.run_id, "power_cycles", r.power_cycles),
                 r);
}

Expected<Bytes> encode(const Profile& profile, const ins::ScheduleRecord& r) {
  Values v;
  put(v, "positions", static_cast<long double>(r.positions.size()));
  put(v, "rotation", r.rotation_ms);
  for (const auto& position : r.positions) {
    const auto theirs = in_their_axes<std::int32_t>(profile, {position.outer_mdeg, position.inner_mdeg});
    put(v, "outer", theirs[0]);
    put(v, "inner", theirs[1]);
    put(v, "dwell", position.dwell_ms);
  }
  return write_fields(profile.schedule.layout, v);
}

Expected<ins::ScheduleRecord> decode_schedule(const Profile& profile, ByteView bytes) {
  const auto v = read_fields(profile.schedule.layout, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  ins::ScheduleRecord r;
  const auto taken = take_whole(*v, profile.schedule, "rotation", r.rotation_ms);
  const auto count = static_cast<std::size_t>(v->number("positions"));
  for (std::size_t i = 0; taken && i < count; ++i) {
    const auto ours = in_our_axes<std::int32_t>(
        profile, {element<std::int32_t>(*v, "outer", i), element<std::int32_t>(*v, "inner", i)});
    r.positions.push_back({ours[0], ours[1], element<std::uint32_t>(*v, "dwell", i)});
  }
  return checked(taken, r);
}

Expected<Bytes> encode(const Profile& profile, const ins::MoveRecord& r) {
  const auto theirs = in_their_axes<std::int32_t>(profile, {r.outer_mdeg, r.inner_mdeg});
  Values v;
  put(v, "outer", theirs[0]);
  put(v, "inner", theirs[1]);
  return write_fields(profile.move->layout, v);
}

Expected<ins::MoveRecord> decode_move(const Profile& profile, ByteView bytes) {
  const auto v = read_fields(profile.move->layout, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  std::array<std::int32_t, 2> theirs{};
  const auto taken = take_all(*v, none, "outer", theirs[0], "inner", theirs[1]);
  const auto ours = in_our_axes(profile, theirs);
  return checked(taken, ins::MoveRecord{ours[0], ours[1]});
}

Expected<Bytes> encode(const Profile& profile, const ins::SiteRecord& r) {
  Values v;
  put(v, "latitude", r.latitude_deg);
  put(v, "longitude", r.longitude_deg);
  put(v, "height", r.height_m);
  return write_fields(profile.site.layout, v);
}

Expected<ins::SiteRecord> decode_site(const Profile& profile, ByteView bytes) {
  const auto v = read_fields(profile.site.layout, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  ins::SiteRecord r;
  take(*v, profile.site, "latitude", r.latitude_deg);
  take(*v, profile.site, "longitude", r.longitude_deg);
  take(*v, profile.site, "height", r.height_m);
  return checked({}, r);
}

Expected<Bytes> encode(const Profile& profile, const ins::DirectoryRecord& r) {
  Values v;
  put(v, "run_id", r.run_id);
  put(v, "first_page", r.first_page);
  put(v, "pages_written", r.pages_written);
  put(v, "pages_expected", r.pages_expected);
  put(v, "samples", static_cast<long double>(r.samples));
  put(v, "complete", r.complete ? 1 : 0);
  return write_fields(profile.directory.layout, v);
}

Expected<ins::DirectoryRecord> decode_directory(const Profile& profile, ByteView bytes) {
  const auto v = read_fields(profile.directory.layout, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  ins::DirectoryRecord r;
  r.complete = v->number("complete") != 0;
  return checked(take_all(*v, profile.directory, "run_id", r.run_id, "first_page", r.first_page, "pages_written",
                          r.pages_written, "pages_expected", r.pages_expected, "samples", r.samples),
                 r);
}

Expected<Bytes> encode(const Profile& profile, const ins::SampleFormatRecord& r) {
  Values v;
  put(v, "sample_rate", r.sample_rate_hz);
  put(v, "angle_per_count", r.delta_theta_lsb_rad);
  put(v, "velocity_per_count", r.delta_v_lsb_mps);
  put(v, "gimbal_per_count", r.gimbal_lsb_rad);
  put(v, "page_bytes", static_cast<long double>(profile.raw.page.bytes));
  put(v, "samples_per_page", r.samples_per_page);
  return write_fields(profile.sample_format.layout, v);
}

// The pages as the service keeps them have one size, whatever the INS's have.
Expected<ins::SampleFormatRecord> decode_sample_format(const Profile& profile, ByteView bytes) {
  const Record& record = profile.sample_format;
  const Layout& page = profile.raw.page;
  const auto v = read_fields(record.layout, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  ins::SampleFormatRecord r;
  r.page_bytes = static_cast<std::uint32_t>(page.bytes);
  r.samples_per_page = static_cast<std::uint16_t>(page.most_repetitions());
  r.gimbal_lsb_rad = gimbal_count_rad;
  take(*v, record, "sample_rate", r.sample_rate_hz);
  take(*v, record, "angle_per_count", r.delta_theta_lsb_rad);
  take(*v, record, "velocity_per_count", r.delta_v_lsb_mps);
  take(*v, record, "gimbal_per_count", r.gimbal_lsb_rad);
  if (const auto taken = take_all(*v, record, "page_bytes", r.page_bytes, "samples_per_page", r.samples_per_page);
      !taken) {
    return tl::unexpected(taken.error());
  }
  for (const auto& [what, told, least, most] :
       {std::tuple("bytes of a page", std::size_t{r.page_bytes}, page.bytes, page.bytes),
        std::tuple("samples of a page", std::size_t{r.samples_per_page}, std::size_t{1}, page.most_repetitions())}) {
    if (told < least || told > most) {
      return fail(ErrorKind::bad_input, fmt::format("{} record: {} is {}, must lie between {} and {}",
                                                    record.layout.record, what, told, least, most));
    }
  }
  r.page_bytes = flash::page_bytes;
  return checked({}, r);
}

Expected<Bytes> encode(const Profile& profile, const ins::RunRecord& r) {
  Values v;
  put(v, "state", static_cast<long double>(r.state));
  put(v, "faults", r.faults);
  put(v, "position", r.position);
  put(v, "run_id", r.run_id);
  put(v, "pages_written", r.pages_written);
  return write_fields(profile.rotate.result, v);
}

Expected<ins::RunRecord> decode_run(const Profile& profile, ByteView bytes) {
  const auto v = read_fields(profile.rotate.result, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  ins::RunRecord r;
  r.state = static_cast<ins::State>(v->number("state"));
  const auto taken = take_all(*v, none, "faults", r.faults, "position", r.position, "run_id", r.run_id, "pages_written",
                              r.pages_written);
  return taken ? Expected<ins::RunRecord>(r) : tl::unexpected(taken.error());
}

Expected<Bytes> encode(const Profile& profile, const ins::NavigationCheckRequest& r) {
  Values v;
  put(v, "duration", r.duration_s);
  put(v, "compensation", static_cast<long double>(r.compensation));
  return write_fields(profile.navigation_check.start, v);
}

Expected<ins::NavigationCheckRequest> decode_navigation_request(const Profile& profile, ByteView bytes) {
  const auto v = read_fields(profile.navigation_check.start, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  ins::NavigationCheckRequest r;
  r.compensation = static_cast<ins::Slot>(v->number("compensation"));
  const auto taken = take_whole(*v, none, "duration", r.duration_s);
  return taken ? Expected<ins::NavigationCheckRequest>(r) : tl::unexpected(taken.error());
}

Expected<Bytes> encode(const Profile& profile, const ins::NavigationCheckRecord& r) {
  Values v;
  put(v, "done", r.done ? 1 : 0);
  put(v, "elapsed", r.elapsed_s);
  put(v, "north", r.north_m);
  put(v, "east", r.east_m);
  put(v, "max_horizontal", r.max_horizontal_m);
  return write_fields(profile.navigation_check.result, v);
}

Expected<ins::NavigationCheckRecord> decode_navigation_result(const Profile& profile, ByteView bytes) {
  const auto v = read_fields(profile.navigation_check.result, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  ins::NavigationCheckRecord r;
  r.done = v->number("done") != 0;
  take(*v, none, "elapsed", r.elapsed_s);
  take(*v, none, "north", r.north_m);
  take(*v, none, "east", r.east_m);
  take(*v, none, "max_horizontal", r.max_horizontal_m);
  return checked({}, r);
}

Expected<Bytes> rotation_start(const Profile& profile, std::uint32_t run_id) {
  Values v;
  put(v, "run_id", run_id);
  return write_fields(profile.rotate.start, v);
}

Expected<std::uint32_t> read_rotation_start(const Profile& profile, ByteView option) {
  const auto v = read_fields(profile.rotate.start, option);
  if (!v) {
    return tl::unexpected(v.error());
  }
  return static_cast<std::uint32_t>(v->number("run_id"));
}

Expected<Bytes> commit_start(const Profile& profile, ByteView set) {
  Values v;
  if (profile.set.checksum) {
    put(v, "checksum", static_cast<long double>(stored_checksum(profile.set, set)));
  }
  return write_fields(profile.commit.start, v);
}

}  // namespace selfcal::profile
