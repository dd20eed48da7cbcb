// RequestUpload or RequestFileTransfer with TransferData and RequestTransferExit, or ReadMemoryByAddress: the oldest page of the latest run.
#include <fmt/format.h>

#include <algorithm>

#include "protocol/profile/raw_file.hpp"
#include "protocol/profile/records.hpp"
#include "protocol/uds/messages.hpp"
#include "tools/cli/device/record_access.hpp"

namespace selfcal::cli::device {
namespace {

using uds::Nrc;
constexpr std::string_view upload = "ISO 14229-1, 14.3", transfer = "ISO 14229-1, 14.4", leave = "ISO 14229-1, 14.5",
                           file = "ISO 14229-1, 14.6";

bool by_file(const profile::Profile& p) { return p.raw.way == profile::Raw::Way::file; }
std::string_view begin_clause(const profile::Profile& p) { return by_file(p) ? file : upload; }

Bytes begin_request(const profile::Profile& p, std::uint32_t run, std::uint32_t page) {
  const profile::Raw& raw = p.raw;
  if (by_file(p)) {
    return uds::file_request(profile::file_name(raw.file, run, page));
  }
  const auto bytes = static_cast<std::uint32_t>(raw.page.bytes);
  return uds::upload_request(raw.by_page ? page : page * bytes, bytes, {raw.address_bytes, raw.size_bytes});
}

std::string fault_of_page(const profile::Profile& p, ByteView bytes, std::uint32_t number, std::uint32_t run_id) {
  if (bytes.size() != p.raw.page.bytes) {
    return fmt::format("{} bytes of a page of {}", bytes.size(), p.raw.page.bytes);
  }
  if (!profile::checksum_holds(p.raw.page, bytes)) {
    return "wrong checksum";
  }
  const auto page = profile::decode_page(p, bytes);
  if (!page) {
    return page.error().message;
  }
  return page->sequence == number && page->run_id == run_id
             ? ""
             : fmt::format("page {} of run {}, page {} of run {} expected", page->sequence, page->run_id, number,
                           run_id);
}

// One upload from its beginning to its end, in which each block answers several requirements.
class Upload {
 public:
  Upload(Conformance& c, const ins::DirectoryRecord& directory) : c_(c), p_(c.profile()), directory_(directory) {}

  void run() {
    const Requirement begun{"upload.begin", begin_clause(p_),
                            "The upload of a page begins, and the longest block is told.", Mode::open};
    const Bytes request = begin_request(p_, directory_.run_id, directory_.first_page);
    const auto response = c_.answered(begun, request, 0, [this](ByteView bytes) { return take_answer(bytes); });
    if (!response) {
      return;
    }
    first_block();
    wrong_counter();
    rest();
  }

 private:
  std::string take_answer(ByteView bytes) {
    if (!by_file(p_)) {
      const auto told = uds::read_upload_response(bytes);
      longest_ = told.value_or(0);
      return told ? "" : told.error().message;
    }
    const auto told = uds::read_file_response(bytes);
    if (!told) {
      return told.error().message;
    }
    longest_ = told->longest;
    return told->bytes == p_.raw.page.bytes
               ? ""
               : fmt::format("a file of {} bytes, a page has {}", told->bytes, p_.raw.page.bytes);
  }

  Exchange block(std::uint8_t number) { return c_.tester().ask(uds::transfer_request(number)); }

  void first_block() {
    const Exchange first = block(1);
    const auto data = uds::read_transfer_response(first.response, 1);
    page_ = data ? Bytes(data->begin(), data->end()) : Bytes{};
    const bool fits = first.response.size() <= longest_ && !page_.empty();
    c_.judged({"transfer.block", transfer, "A block repeats its counter and is no longer than was told."}, "36 01",
              fmt::format("76 01 and data, {} bytes at most", longest_),
              first.kind == Exchange::Kind::positive
                  ? fmt::format("{}, {} bytes", hex(first.response), first.response.size())
                  : words(first),
              fits);
    const Exchange again = block(1);
    c_.judged({"transfer.repeat", transfer, "The block before is told again where it is asked for again."},
              "36 01 again", "the same data", again.response == first.response ? "the same data" : words(again),
              again.kind == Exchange::Kind::positive && again.response == first.response);
  }

  void wrong_counter() {
    constexpr std::uint8_t wrong = 7;
    const Exchange exchange = block(wrong);
    c_.judged({"transfer.counter", transfer, "A block counter that is neither the next nor the last one is refused."},
              fmt::format("36 {:02X} after 36 01", wrong), "wrongBlockSequenceCounter (0x73)", words(exchange),
              exchange.kind == Exchange::Kind::negative &&
                  exchange.nrc == static_cast<std::uint8_t>(Nrc::wrong_block_sequence_counter));
  }

  void rest() {
    std::uint8_t number = 1;
    std::string fault;
    while (fault.empty() && !page_.empty() && page_.size() < p_.raw.page.bytes) {
      const Exchange next = block(++number);
      const auto data = uds::read_transfer_response(next.response, number);
      if (!data || data->empty()) {
        fault = words(next);
      } else {
        page_.insert(page_.end(), data->begin(), data->end());
      }
    }
    fault = fault.empty() ? fault_of_page(p_, page_, directory_.first_page, directory_.run_id) : fault;
    c_.judged({"transfer.page", "profile, page", "The data are the page that was asked for, whole."},
              fmt::format("36 01 to 36 {:02X}", number),
              fmt::format("page {} of run {}", directory_.first_page, directory_.run_id),
              fault.empty() ? "that page" : fault, fault.empty());
    const Exchange beyond = block(static_cast<std::uint8_t>(number + 1));
    c_.judged({"transfer.end", transfer, "After the last block there is none."}, fmt::format("36 {:02X}", number + 1),
              "requestSequenceError (0x24)", words(beyond),
              beyond.kind == Exchange::Kind::negative &&
                  beyond.nrc == static_cast<std::uint8_t>(Nrc::request_sequence_error));
    const Exchange end = c_.tester().ask(uds::transfer_exit_request());
    c_.judged({"transfer.exit", leave, "The upload ends."}, "37", "77", words(end),
              end.kind == Exchange::Kind::positive);
  }

  Conformance& c_;
  const profile::Profile& p_;
  ins::DirectoryRecord directory_;
  std::uint32_t longest_ = 0;
  Bytes page_;
};

Expected<ins::DirectoryRecord> directory_of(Conformance& c) {
  const profile::Profile& p = c.profile();
  const RecordExchange told = read_record(c, *p.directory.did);
  return told.record ? profile::decode_directory(p, *told.record)
                     : fail(ErrorKind::device, fmt::format("the directory cannot be read: {}", words(told.exchange)));
}

constexpr std::string_view memory = "ISO 14229-1, 10.3";

Bytes memory_request(const profile::Profile& p, std::uint64_t address, std::uint32_t bytes) {
  return uds::memory_request(static_cast<std::uint32_t>(address), bytes, {p.raw.address_bytes, p.raw.size_bytes});
}

// A page, in as many requests as it takes.
void try_page_of_memory(Conformance& c, const ins::DirectoryRecord& directory) {
  const profile::Profile& p = c.profile();
  const profile::Raw& raw = p.raw;
  constexpr Requirement whole{"memory.page", memory, "The data are the page that was asked for, whole.", Mode::open};
  if (directory.pages_written <= directory.first_page) {
    return c.not_tried(whole, "the INS holds no raw data");
  }
  if (!c.ready(whole)) {
    return;
  }
  const std::uint64_t begin = raw.first_address + std::uint64_t{directory.first_page} * raw.page.bytes;
  Bytes page;
  std::string fault;
  while (fault.empty() && page.size() < raw.page.bytes) {
    const auto wanted =
        static_cast<std::uint32_t>(std::min<std::size_t>(raw.longest_read, raw.page.bytes - page.size()));
    const Exchange told = c.tester().ask(memory_request(p, begin + page.size(), wanted));
    const auto data = uds::read_memory_response(told.response, wanted);
    if (data) {
      page.insert(page.end(), data->begin(), data->end());
    } else {
      fault = fmt::format("{}: {}", words(told), data.error().message);
    }
  }
  fault = fault.empty() ? fault_of_page(p, page, directory.first_page, directory.run_id) : fault;
  c.judged(whole, fmt::format("{} and so on", hex(memory_request(p, begin, raw.longest_read))),
           fmt::format("page {} of run {}", directory.first_page, directory.run_id),
           fault.empty() ? "that page" : fault, fault.empty());
}

void try_memory(Conformance& c) {
  const profile::Profile& p = c.profile();
  const auto directory = directory_of(c);
  constexpr Requirement range{"memory.range", memory, "Memory outside the pages is refused.", Mode::open};
  if (!directory) {
    return c.not_tried(range, directory.error().message);
  }
  const std::uint64_t beyond = p.raw.first_address + (std::uint64_t{directory->pages_written} + 1) * p.raw.page.bytes;
  c.refused(range, memory_request(p, beyond, 1), {Nrc::request_out_of_range});
  Bytes format = memory_request(p, p.raw.first_address, 1);
  format[1] = 0x11;
  c.refused({"memory.format", memory, "Another format of address and size is refused.", Mode::open}, format,
            {Nrc::request_out_of_range, Nrc::incorrect_message_length});
  c.refused({"memory.session", "ISO 14229-1, 7.5", "In the default session no memory is told."},
            memory_request(p, p.raw.first_address, 1),
            {Nrc::service_not_supported_in_session, Nrc::security_access_denied, Nrc::request_out_of_range});
  try_page_of_memory(c, *directory);
}

}  // namespace

void try_raw_data(Conformance& c) {
  const profile::Profile& p = c.profile();
  if (p.raw.way == profile::Raw::Way::memory) {
    return try_memory(c);
  }
  if (p.raw.way == profile::Raw::Way::stream) {
    return c.not_tried({"stream.samples", "profile, stream", "Samples come while it rotates, each once.", Mode::open},
                       "nothing is turned by a check");
  }
  c.refused({"transfer.none", transfer, "Without an upload there is no block.", Mode::open}, uds::transfer_request(1),
            {Nrc::request_sequence_error});
  c.refused({"transfer.no_exit", leave, "Without an upload there is none to end.", Mode::open},
            uds::transfer_exit_request(), {Nrc::request_sequence_error});
  const auto directory = directory_of(c);
  const std::uint32_t run = directory ? directory->run_id : 0;
  Bytes format = begin_request(p, run, 0);
  (by_file(p) ? format.back() : format[1]) = 0x11;
  c.refused({"upload.format", begin_clause(p), "Compressed or encrypted data are refused.", Mode::open}, format,
            {Nrc::request_out_of_range});
  const Requirement begin{"upload.begin", begin_clause(p),
                          "The upload of a page begins, and the longest block is told.", Mode::open};
  if (!directory) {
    return c.not_tried(begin, directory.error().message);
  }
  c.refused({"upload.range", begin_clause(p), "Pages that are not there are refused.", Mode::open},
            begin_request(p, run, directory->pages_written + 1), {Nrc::request_out_of_range});
  if (directory->pages_written <= directory->first_page) {
    return c.not_tried(begin, "the INS holds no raw data");
  }
  Upload(c, *directory).run();
}

}  // namespace selfcal::cli::device
