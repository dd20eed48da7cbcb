// The two records that are more than a list of numbers: a set of the 24, and a page of raw data.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocol/profile/coefficient_fields.hpp"
#include "protocol/profile/records.hpp"

namespace selfcal::profile {
namespace {

constexpr double turn = 2.0 * 3.14159265358979323846;

// An angle as binary counts of a turn.
std::uint16_t counts_of(long double radians) {
  const long double turns = radians / turn;
  return static_cast<std::uint16_t>(std::llround((turns - std::floor(turns)) * flash::counts_per_turn) %
                                    static_cast<long long>(flash::counts_per_turn));
}

template <typename T>
T whole(const Values& values, std::string_view name) {
  return static_cast<T>(
      std::round(std::clamp(values.number(name), static_cast<long double>(std::numeric_limits<T>::min()),
                            static_cast<long double>(std::numeric_limits<T>::max()))));
}

// K+ and K- where the INS has one factor k: df = k f is K+ = k and, because K- multiplies |f|, K- = -k.
constexpr std::size_t from_plus_to_minus = 3;

}  // namespace

Expected<Bytes> encode(const Profile& profile, const ins::Coefficients& set) {
  const auto told = to_write(profile.set_form, set.value);
  if (!told) {
    return fail(ErrorKind::bad_input, fmt::format("{} record: {}", profile.set.record, told.error().message));
  }
  Values v;
  v.numbers["version"] = {static_cast<long double>(set.version)};
  v.numbers["date"] = {static_cast<long double>(set.date_s)};
  v.texts["author"] = set.author;
  for (const Field& field : profile.set.fields) {
    if (const auto span = span_of(field.name)) {
      std::vector<long double>& values = v.numbers[field.name];
      for (std::size_t k = span->first; k < span->first + span->count; ++k) {
        values.push_back(span->one_factor ? ((*told)[k] - (*told)[k + from_plus_to_minus]) / 2 : (*told)[k]);
      }
    }
  }
  return write_fields(profile.set, v);
}

Expected<ins::Coefficients> decode_coefficients(const Profile& profile, ByteView bytes) {
  const auto v = read_fields(profile.set, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  ins::Coefficients set;
  set.version = whole<std::uint32_t>(*v, "version");
  set.date_s = whole<std::int64_t>(*v, "date");
  set.author = v->text("author").substr(0, ins::author_bytes);
  for (const Field& field : profile.set.fields) {
    const auto span = span_of(field.name);
    for (std::size_t k = 0; span && k < span->count; ++k) {
      const auto value = static_cast<double>(v->numbers.find(field.name)->second[k]);
      if (!std::isfinite(value)) {
        return fail(ErrorKind::bad_input, fmt::format("{} record: {} is {}, not a finite number", profile.set.record,
                                                      ins::coefficient_names[span->first + k], value));
      }
      set.value[span->first + k] = value;
      if (span->one_factor) {
        set.value[span->first + k + from_plus_to_minus] = -value;
      }
    }
  }
  const auto errors = converted(profile.set_form, set.value);
  if (!errors) {
    return fail(ErrorKind::bad_input, fmt::format("{} record: {}", profile.set.record, errors.error().message));
  }
  set.value = *errors;
  return set;
}

Expected<Bytes> encode_page(const Profile& profile, const flash::Page& page) {
  const Raw& raw = profile.raw;
  Values v;
  v.numbers["samples"] = {static_cast<long double>(page.samples.size())};
  v.numbers["run_id"] = {static_cast<long double>(page.run_id)};
  v.numbers["sequence"] = {static_cast<long double>(page.sequence)};
  v.numbers["first_sample"] = {static_cast<long double>(page.first_sample)};
  v.numbers["temperature"] = {static_cast<long double>(page.temperature_c)};
  v.numbers["flags"] = {static_cast<long double>(page.flags)};
  for (const flash::SampleCounts& sample : page.samples) {
    for (const auto& [name, counts] :
         {std::pair("delta_theta", &sample.delta_theta), std::pair("delta_v", &sample.delta_v)}) {
      std::array<std::int64_t, 3> theirs{};
      for (std::size_t k = 0; k < 3; ++k) {
        theirs[raw.axis[k]] = std::int64_t{raw.sign[k]} * (*counts)[k];
      }
      auto& into = v.numbers[name];
      into.insert(into.end(), theirs.begin(), theirs.end());
    }
    const std::array ours{sample.outer, sample.inner};
    std::array<int, 2> theirs{};
    for (std::size_t k = 0; k < 2; ++k) {
      theirs[raw.gimbal[k]] = raw.gimbal_sign[k] > 0 || ours[k] == 0 ? ours[k] : 65536 - ours[k];
    }
    for (const auto& [name, counts] : {std::pair("outer", theirs[0]), std::pair("inner", theirs[1])}) {
      const Field* field = raw.page.find(name);
      const bool angle = !field->unit.empty();
      v.numbers[name].push_back(angle ? counts / static_cast<long double>(flash::counts_per_turn) * turn : counts);
    }
  }
  return write_fields(raw.page, v);
}

Expected<flash::Page> decode_page(const Profile& profile, ByteView bytes) {
  const Raw& raw = profile.raw;
  const auto v = read_fields(raw.page, bytes);
  if (!v) {
    return tl::unexpected(v.error());
  }
  flash::Page page;
  page.run_id = whole<std::uint32_t>(*v, "run_id");
  page.sequence = whole<std::uint32_t>(*v, "sequence");
  page.first_sample = v->has("first_sample") ? whole<std::uint64_t>(*v, "first_sample")
                                             : std::uint64_t{page.sequence} * raw.page.most_repetitions();
  page.temperature_c = static_cast<double>(v->number("temperature"));
  page.flags = whole<std::uint16_t>(*v, "flags");
  page.samples.resize(static_cast<std::size_t>(v->number("samples")));
  if (page.samples.empty()) {
    return page;
  }
  const auto& angles = v->numbers.find("delta_theta")->second;
  const auto& velocities = v->numbers.find("delta_v")->second;
  const std::array gimbal{&v->numbers.find("outer")->second, &v->numbers.find("inner")->second};
  const std::array in_radians{!raw.page.find("outer")->unit.empty(), !raw.page.find("inner")->unit.empty()};
  for (std::size_t i = 0; i < page.samples.size(); ++i) {
    flash::SampleCounts& sample = page.samples[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t theirs = 3 * i + raw.axis[k];
      sample.delta_theta[k] =
          static_cast<std::int32_t>(std::clamp(raw.sign[k] * angles[theirs], -2147483648.0L, 2147483647.0L));
      sample.delta_v[k] =
          static_cast<std::int32_t>(std::clamp(raw.sign[k] * velocities[theirs], -2147483648.0L, 2147483647.0L));
    }
    for (std::size_t k = 0; k < 2; ++k) {
      const std::size_t theirs = raw.gimbal[k];
      const long double told = (*gimbal[theirs])[i];
      const auto counts = in_radians[theirs] ? counts_of(told) : static_cast<std::uint16_t>(told);
      (k == 0 ? sample.outer : sample.inner) =
          raw.gimbal_sign[k] > 0 ? counts : static_cast<std::uint16_t>(65536 - counts);
    }
  }
  return page;
}

}  // namespace selfcal::profile
