#include "daemon/store/page_recording.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "protocol/byte_order.hpp"
#include "protocol/flash/page.hpp"
#include "protocol/recording/atomic_file.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;

fs::path context_path(const fs::path& folder) { return folder / "pages.context"; }

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

}  // namespace

fs::path page_path(const fs::path& folder) { return folder / "pages"; }
fs::path recording_path(const fs::path& folder) { return folder / "recording.h5"; }

void drop_pages(const fs::path& folder) {
  std::error_code ignored;
  std::vector<fs::path> useless;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.path() != recording_path(folder)) {
      useless.push_back(entry.path());
    }
  }
  for (const fs::path& path : useless) {
    fs::remove(path, ignored);
  }
}

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
  if (!text) {
    return tl::unexpected(text.error());
  }
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(text->data()), text->size());
  const std::size_t site_bytes = ins::encode(ins::SiteRecord{}).size();
  if (bytes.size() < 4 + site_bytes) {
    return fail(ErrorKind::device, fmt::format("{}: cut short", context_path(folder).string()));
  }
  PageContext context;
  context.pages = ByteReader(bytes).get<std::uint32_t>();
  const auto site = ins::decode_site(bytes.subspan(4, site_bytes));
  if (!site) {
    return tl::unexpected(site.error());
  }
  const auto format = ins::decode_sample_format(bytes.subspan(4 + site_bytes));
  if (!format) {
    return tl::unexpected(format.error());
  }
  context.site = *site;
  context.format = *format;
  return context;
}

Schedule schedule_until(const Schedule& schedule, double seconds) {
  Schedule part{{}, {}, schedule.rotation_s};
  double begin = 0.0;
  for (std::size_t i = 0; i < schedule.positions.size() && (i == 0 || begin < seconds); ++i) {
    part.positions.push_back(schedule.positions[i]);
    part.dwell_s.push_back(std::min(schedule.dwell_s[i], seconds - begin));
    begin += schedule.dwell_s[i] + schedule.rotation_s;
  }
  return part;
}

Expected<PageRecording> PageRecording::begin(const EstimateRequest& request) {
  auto context = read_page_context(request.folder);
  if (!context) {
    return tl::unexpected(context.error());
  }
  return PageRecording(request, *context);
}

PageRecording::PageRecording(const EstimateRequest& request, PageContext context)
    : file_(page_path(request.folder)), rotation_(request.rotation), context_(context) {
  const bool own = request.config.site_given;
  recording_.serial = request.serial;
  recording_.sample_rate_hz = context_.format.sample_rate_hz;
  recording_.latitude_deg = own ? request.config.latitude_deg : context_.site.latitude_deg;
  recording_.longitude_deg = own ? request.config.longitude_deg : context_.site.longitude_deg;
  recording_.height_m = own ? request.config.height_m : context_.site.height_m;
  recording_.start_time_utc = request.started_utc;
  recording_.temperature_channels = 1;
}

double PageRecording::duration_s() const { return static_cast<double>(recording_.size()) / recording_.sample_rate_hz; }

Expected<void> PageRecording::take(std::uint32_t end) {
  std::ifstream in(file_, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(taken_) * static_cast<std::streamoff>(flash::page_bytes));
  flash::PageBytes bytes;
  flash::Page page;
  for (; taken_ < end; ++taken_) {
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    const bool whole = in && flash::decode_page(bytes, page) && page.run_id == rotation_;
    if (!whole || page.sequence != taken_ || page.first_sample != recording_.size()) {
      return fail(ErrorKind::device, fmt::format("{}: page {} is not what was pulled", file_.string(), taken_));
    }
    if ((page.flags & flash::page_flag::sensor_saturated) != 0) {
      ++saturated_;
    }
    append(page, context_.format, recording_);
  }
  return {};
}

}  // namespace selfcal
