#include "daemon/estimate_job.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "daemon/calibration/calibrate_recording.hpp"
#include "daemon/calibration/result_json.hpp"
#include "protocol/byte_order.hpp"
#include "protocol/flash/page.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/hdf5.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;

// The HDF5 library is not made for several threads, and every INS has an estimator's thread.
std::mutex hdf5_mutex;

fs::path context_path(const fs::path& folder) { return folder / "pages.context"; }

CalibrationOptions options_of(const InsConfig& config) {
  CalibrationOptions options;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    if (config.tolerance[i]) {
      options.tolerance(static_cast<Eigen::Index>(i)) = *config.tolerance[i] * sensor_parameters[i].si_per_unit;
    }
  }
  return options;
}

std::vector<std::string> beyond_limits(const CalibrationResult& result, const InsConfig& config) {
  std::vector<std::string> found;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    const SensorParameter& parameter = sensor_parameters[i];
    const double value = result.value(static_cast<Eigen::Index>(i)) / parameter.si_per_unit;
    if (config.limit[i] && std::abs(value) > *config.limit[i]) {
      found.push_back(fmt::format("{} implausible: {:.4g} {}, limit {:.4g}", parameter.name, value, parameter.unit,
                                  *config.limit[i]));
    }
  }
  return found;
}

void append(const flash::Page& page, const ins::SampleFormatRecord& format, Recording& recording) {
  for (const flash::SampleCounts& sample : page.samples) {
    recording.time_s.push_back(static_cast<double>(recording.time_s.size() + 1) / format.sample_rate_hz);
    std::array<double, 3> delta_theta{}, delta_v{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      delta_theta[axis] = sample.delta_theta[axis] * format.delta_theta_lsb_rad;
      delta_v[axis] = sample.delta_v[axis] * format.delta_v_lsb_mps;
    }
    recording.delta_theta_rad.push_back(delta_theta);
    recording.delta_v_mps.push_back(delta_v);
    recording.gimbal_outer_rad.push_back(sample.outer * format.gimbal_lsb_rad);
    recording.gimbal_inner_rad.push_back(sample.inner * format.gimbal_lsb_rad);
    recording.temperature_c.push_back(page.temperature_c);
  }
}

Expected<Estimate> run_estimate(const EstimateRequest& request, const EstimateProgress& progress,
                                const std::stop_token& stop) {
  Estimate estimate;
  auto recording = recording_from_pages(request, estimate.warnings);
  if (!recording) return tl::unexpected(recording.error());
  {
    const std::lock_guard lock(hdf5_mutex);
    if (auto written = write_hdf5(*recording, recording_path(request.folder)); !written) {
      return tl::unexpected(written.error());
    }
  }
  estimate.recording = recording_path(request.folder).string();
  const auto suspect = check_recording(*recording);
  if (!suspect) return tl::unexpected(suspect.error());
  estimate.warnings.insert(estimate.warnings.end(), suspect->begin(), suspect->end());
  const CalibrationOptions options = options_of(request.config);
  auto result = calibrate_recording(*recording, options, progress, stop);
  if (!result) return tl::unexpected(result.error());
  estimate.result = std::move(*result);
  estimate.objections = objections(estimate.result, options);
  for (std::string& beyond : beyond_limits(estimate.result, request.config)) {
    estimate.objections.push_back(std::move(beyond));
  }
  estimate.result_json = result_json_text(estimate.result, options, *recording, estimate.warnings);
  return estimate;
}

}  // namespace

fs::path page_path(const fs::path& folder) { return folder / "pages"; }
fs::path recording_path(const fs::path& folder) { return folder / "recording.h5"; }

Expected<void> write_page_context(const fs::path& folder, const PageContext& context) {
  std::string bytes(4, '\0');
  ByteWriter(std::span(reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size())).put(context.pages);
  for (const ins::Bytes& part : {ins::encode(context.site), ins::encode(context.format)}) {
    bytes.append(part.begin(), part.end());
  }
  return write_file_atomically(context_path(folder), bytes);
}

Expected<PageContext> read_page_context(const fs::path& folder) {
  const auto text = read_text_file(context_path(folder), 4096);
  if (!text) return tl::unexpected(text.error());
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(text->data()), text->size());
  const std::size_t site_bytes = ins::encode(ins::SiteRecord{}).size();
  if (bytes.size() < 4 + site_bytes) {
    return fail(ErrorKind::device, fmt::format("{}: cut short", context_path(folder).string()));
  }
  PageContext context;
  context.pages = ByteReader(bytes).get<std::uint32_t>();
  const auto site = ins::decode_site(bytes.subspan(4, site_bytes));
  if (!site) return tl::unexpected(site.error());
  const auto format = ins::decode_sample_format(bytes.subspan(4 + site_bytes));
  if (!format) return tl::unexpected(format.error());
  context.site = *site;
  context.format = *format;
  return context;
}

Expected<Recording> recording_from_pages(const EstimateRequest& request, std::vector<std::string>& warnings) {
  const auto context = read_page_context(request.folder);
  if (!context) return tl::unexpected(context.error());
  Recording recording;
  recording.serial = request.serial;
  recording.sample_rate_hz = context->format.sample_rate_hz;
  const bool own = request.config.site_given;
  recording.latitude_deg = own ? request.config.latitude_deg : context->site.latitude_deg;
  recording.longitude_deg = own ? request.config.longitude_deg : context->site.longitude_deg;
  recording.height_m = own ? request.config.height_m : context->site.height_m;
  const auto& dwell = request.schedule.dwell_s;
  if (!dwell.empty() && std::all_of(dwell.begin(), dwell.end(), [&](double s) { return s == dwell[0]; })) {
    recording.dwell_s = dwell[0];
  }
  recording.rotation_s = request.schedule.rotation_s;
  recording.start_time_utc = request.started_utc;
  recording.temperature_channels = 1;
  for (const GimbalPosition& position : request.schedule.positions) {
    recording.schedule_deg.push_back({position.outer_deg, position.inner_deg});
  }

  std::ifstream in(page_path(request.folder), std::ios::binary);
  flash::PageBytes bytes;
  flash::Page page;
  std::uint32_t saturated = 0;
  for (std::uint32_t i = 0; i < context->pages; ++i) {
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    const bool whole = in && flash::decode_page(bytes, page) && page.run_id == request.rotation;
    if (!whole || page.sequence != i || page.first_sample != recording.size()) {
      return fail(ErrorKind::device, fmt::format("{}: page {} is not what was pulled", page_path(request.folder).string(), i));
    }
    if ((page.flags & flash::page_flag::sensor_saturated) != 0) ++saturated;
    append(page, context->format, recording);
  }
  if (saturated > 0) warnings.push_back(fmt::format("a sensor was saturated in {} pages", saturated));
  return recording;
}

EstimateJob estimate_job(EstimateRequest request) {
  return [request = std::move(request)](const EstimateProgress& progress, std::stop_token stop) {
    return run_estimate(request, progress, stop);
  };
}

}  // namespace selfcal
