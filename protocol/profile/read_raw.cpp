#include "protocol/profile/read_raw.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "protocol/profile/raw_file.hpp"
#include "protocol/profile/read_frames.hpp"
#include "protocol/profile/read_layout.hpp"

namespace selfcal::profile {
namespace {

constexpr std::uint32_t longest_message = 4094;  // ISO-TP's 12 bits of length, less the service
constexpr std::uint64_t most_samples = 145;      // of a page, as the service keeps it
constexpr std::array<std::string_view, 2> address_units{"page", "byte"};

class RawReader {
 public:
  RawReader(Section& root, Profile& profile, ByteOrder order)
      : root_(root), faults_(root.faults()), profile_(profile), raw_(profile.raw), order_(order) {}

  void read() {
    if (read_way()) {
      read_page();
    }
  }

 private:
  // False: there are no pages.
  bool read_way() {
    Section memory = root_.table("memory");
    // Without an address it says how records are asked for.
    const bool of_raw = memory.there() && (memory.has("address") || profile_.memory.regions.empty());
    if (memory.there()) {
      read_memory(memory, of_raw);
    }
    Section file = root_.table("file");
    if (file.there()) {
      read_file(file);
    }
    Section stream = root_.table("stream");
    Section upload = root_.table("upload", !memory.there() && !file.there() && !stream.there());
    const int ways = int{upload.there()} + int{of_raw} + int{file.there()} + int{stream.there()};
    if (ways == 0 && memory.there()) {
      memory.fault("address", "missing, and there is no upload, file or stream in its place");
    } else if (ways > 1) {
      (upload.there() ? upload : file.there() ? file : stream).fault("", "and another: the raw data come in one way");
    }
    if (upload.there() && !stream.there()) {
      read_upload(upload);
    }
    if (stream.there()) {
      read_stream_of_samples(stream);
    }
    return !stream.there();
  }

  void read_upload(Section& upload) {
    raw_.by_page = upload.word("address", address_units, true).value_or("page") == "page";
    raw_.address_bytes = upload.whole("address_bytes", 1, 4).value_or(4);
    raw_.size_bytes = upload.whole("size_bytes", 1, 4).value_or(4);
    upload.only_these();
  }

  void read_page() {
    Section page = root_.table("page", true);
    if (!page.there()) {
      return;
    }
    Record record;
    if (!page.has("bytes")) {
      page.missing("bytes");
    }
    read_layout(page, record_role("page"), order_, record);
    page.only_these();
    if (!record.given.empty()) {
      page.fault("given", "a page has no such values");
    }
    check_page(page, record.layout);
    check_gimbal(record.layout);
    raw_.page = std::move(record.layout);
  }

  static std::uint64_t largest(std::size_t bytes) { return (std::uint64_t{1} << (8 * bytes)) - 1; }

  void read_stream_of_samples(Section& stream) {
    profile_.stream = read_stream(stream, profile_, order_);
    raw_.way = Raw::Way::stream;
    raw_.by_page = false;
    raw_.longest_read = longest_message;
    raw_.page = built_in()->raw.page;
    if (root_.has("page")) {
      root_.fault("page", "the samples are streamed: there are none");
      root_.table("page");
    }
    for (const std::string_view name : {"gimbal_per_count", "page_bytes", "samples_per_page"}) {
      const Field* field = profile_.sample_format.layout.find(name);
      if (field != nullptr || profile_.sample_format.given.contains(name)) {
        faults_.add(field != nullptr ? field->line : root_.line_of("sample_format"),
                    fmt::format("sample_format.{}{}", field != nullptr ? "fields." : "given.", name),
                    "the samples are streamed: there are no pages, and the gimbal is told as an angle");
      }
    }
  }

  // How the INS's memory is asked for, and what it tells and takes at once.
  void read_memory(Section& memory, bool of_raw) {
    RecordMemory& records = profile_.memory;
    records.address_bytes = memory.whole("address_bytes", 1, 4).value_or(4);
    records.size_bytes = memory.whole("size_bytes", 1, 4).value_or(2);
    const std::uint64_t largest_size = largest(records.size_bytes);
    constexpr std::uint64_t shortest = 32;
    const auto longest =
        memory.whole("longest", shortest, std::min<std::uint64_t>(longest_message, largest_size), true);
    records.longest_read = static_cast<std::uint32_t>(longest.value_or(shortest));
    const std::uint64_t most_written =
        std::min(longest_message - 1 - records.address_bytes - records.size_bytes, largest_size);
    records.longest_write =
        static_cast<std::uint32_t>(memory.whole("longest_write", 1, most_written)
                                       .value_or(std::min<std::uint64_t>(records.longest_read, most_written)));
    if (of_raw) {
      read_memory_of_raw(memory, records);
    }
    memory.only_these();
  }

  // ReadMemoryByAddress: pages of the run one behind the other.
  void read_memory_of_raw(Section& memory, const RecordMemory& asked) {
    raw_.way = Raw::Way::memory;
    raw_.by_page = false;
    raw_.address_bytes = asked.address_bytes;
    raw_.size_bytes = asked.size_bytes;
    raw_.longest_read = asked.longest_read;
    const std::uint64_t last = largest(asked.address_bytes);
    raw_.first_address = static_cast<std::uint32_t>(memory.whole("address", 0, last, true).value_or(0));
    raw_.end_address = memory.whole("end", std::uint64_t{raw_.first_address} + 1, last + 1).value_or(last + 1);
  }

  // RequestFileTransfer: each page is a file.
  void read_file(Section& file) {
    raw_.way = Raw::Way::file;
    raw_.by_page = false;
    raw_.file = file.text("name", true).value_or("");
    if (const std::string fault = fault_of_file_pattern(raw_.file); file.has("name") && !fault.empty()) {
      file.fault("name", fault);
    }
    file.only_these();
  }

  void check_page(Section& page, const Layout& layout) {
    if (layout.each && layout.bytes > 0 && layout.most_repetitions() > most_samples) {
      page.fault("bytes", fmt::format("{} samples fit, {} are the most", layout.most_repetitions(), most_samples));
    }
    for (const std::string_view name : {"delta_theta", "delta_v"}) {
      const Field* field = layout.find(name);
      if (field != nullptr && (field->type.kind != Kind::signed_integer || field->type.bytes > 4 ||
                               field->scale != 1.0 || field->offset != 0.0)) {
        faults_.add(field->line, fmt::format("page.each.fields.{}", name),
                    "counts are i8 to i32 without scale, offset and unit: sample_format says what they are worth");
      }
    }
    for (const std::string_view name : {"outer", "inner"}) {
      const Field* field = layout.find(name);
      if (field != nullptr && field->unit.empty() && field->type.name != "u16") {
        faults_.add(field->line, fmt::format("page.each.fields.{}", name),
                    "counts are u16; with a unit it may be any type");
      }
    }
  }

  void check_gimbal(const Layout& page) {
    const Field* outer = page.find("outer");
    const Field* inner = page.find("inner");
    if (outer == nullptr || inner == nullptr) {
      return;
    }
    const Record& format = profile_.sample_format;
    const bool told = format.layout.find("gimbal_per_count") != nullptr || format.given.contains("gimbal_per_count");
    if (outer->unit.empty() != inner->unit.empty()) {
      faults_.add(std::max(outer->line, inner->line), "page.each.fields",
                  "outer and inner: both in counts or both with a unit");
    } else if (outer->unit.empty() != told) {
      faults_.add(root_.line_of("sample_format"), "sample_format.fields.gimbal_per_count",
                  told ? "told, and the page has angles with a unit" : "missing, and the page has counts");
    }
  }

  Section& root_;
  Faults& faults_;
  Profile& profile_;
  Raw& raw_;
  ByteOrder order_;
};

}  // namespace

void read_raw(Section& root, Profile& profile, ByteOrder order) { RawReader(root, profile, order).read(); }

}  // namespace selfcal::profile
