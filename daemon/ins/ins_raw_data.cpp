// The raw data of an INS: RequestUpload, ReadMemoryByAddress, RequestFileTransfer, or what is kept of a stream, page by page.
#include <fmt/format.h>

#include <algorithm>

#include "daemon/ins/ins_client.hpp"
#include "daemon/ins/kept_form.hpp"
#include "protocol/profile/raw_file.hpp"
#include "protocol/uds/messages.hpp"

namespace selfcal {
namespace {

constexpr std::size_t longest_other = 128;
// Where a second tester is on the bus the answer to its question may come first.
constexpr int attempts = 4;
// A block of less than this would make one page cost a hundred round trips and more.
constexpr std::size_t least_block_data = 32;

}  // namespace

// Asked again where the answer makes no sense: the block counter tells the INS that it is the same block.
Task<Answer<Bytes>> InsClient::next_block(std::uint8_t block, std::uint32_t longest) {
  for (int attempt = 1;; ++attempt) {
    const Answer<Bytes> response = co_await ask(uds::transfer_request(block), longest);
    if (!response) {
      if (response.error().kind == PortError::Kind::protocol && attempt < attempts) {
        continue;
      }
      co_return tl::unexpected(response.error());
    }
    const auto part = uds::read_transfer_response(*response, block);
    if (!part) {
      co_return protocol_error(port_, part.error());
    }
    co_return Bytes(part->begin(), part->end());
  }
}

Task<Answer<Done>> InsClient::upload(std::uint32_t first, std::uint32_t count, OnPage on_page) {
  switch (profile_->raw.way) {
    case profile::Raw::Way::stream:  // from what is kept of it (stream_port)
    case profile::Raw::Way::memory: return read_memory(first, count, std::move(on_page));
    case profile::Raw::Way::file: return read_files(first, count, std::move(on_page));
    default: return upload_pages(first, count, std::move(on_page));
  }
}

// Page by page, each in as many requests as the INS tells bytes at once.
Task<Answer<Done>> InsClient::read_memory(std::uint32_t first, std::uint32_t count, OnPage on_page) {
  const profile::Raw& raw = profile_->raw;
  const std::uint64_t page_bytes = raw.page.bytes;
  const std::uint64_t end = raw.first_address + (std::uint64_t{first} + count) * page_bytes;
  if (((end - 1) >> (8 * raw.address_bytes)) != 0) {
    co_return protocol_error(
        port_, {ErrorKind::device,
                fmt::format("ReadMemoryByAddress: address {:X} does not fit {} bytes", end - 1, raw.address_bytes)});
  }
  if (end > raw.end_address) {
    co_return protocol_error(
        port_, {ErrorKind::device, fmt::format("ReadMemoryByAddress: page {} ends at {:X}, the raw data end at {:X}",
                                               first + count - 1, end - 1, raw.end_address - 1)});
  }
  for (std::uint32_t page = first; page < first + count; ++page) {
    Bytes data;
    while (data.size() < page_bytes) {
      const auto address = static_cast<std::uint32_t>(raw.first_address + page * page_bytes + data.size());
      const auto wanted =
          static_cast<std::uint32_t>(std::min<std::uint64_t>(raw.longest_read, page_bytes - data.size()));
      const Answer<Bytes> response = co_await ask(
          uds::memory_request(address, wanted, {raw.address_bytes, raw.size_bytes}), std::size_t{wanted} + 1);
      if (!response) {
        co_return tl::unexpected(response.error());
      }
      const auto part = uds::read_memory_response(*response, wanted);
      if (!part) {
        co_return protocol_error(port_, part.error());
      }
      data.insert(data.end(), part->begin(), part->end());
    }
    on_page(page, page_as_kept(*profile_, data));
  }
  co_return Done{};
}

Task<Answer<Done>> InsClient::upload_pages(std::uint32_t first, std::uint32_t count, OnPage on_page) {
  const profile::Raw& raw = profile_->raw;
  const std::size_t page_bytes = raw.page.bytes;
  const std::size_t wanted = std::size_t{count} * page_bytes;
  const std::size_t address = raw.by_page ? first : std::size_t{first} * page_bytes;
  const auto fits = [](std::size_t value, std::size_t bytes) { return bytes >= 8 || value >> (8 * bytes) == 0; };
  if (!fits(address, raw.address_bytes) || !fits(wanted, raw.size_bytes)) {
    co_return protocol_error(
        port_, {ErrorKind::device, fmt::format("RequestUpload: address {} and size {} do not fit {} and {} bytes",
                                               address, wanted, raw.address_bytes, raw.size_bytes)});
  }
  const Answer<Bytes> response =
      co_await ask(uds::upload_request(static_cast<std::uint32_t>(address), static_cast<std::uint32_t>(wanted),
                                       {raw.address_bytes, raw.size_bytes}),
                   longest_other);
  if (!response) {
    co_return tl::unexpected(response.error());
  }
  const auto longest = uds::read_upload_response(*response);
  if (!longest) {
    co_return protocol_error(port_, longest.error());
  }
  co_return co_await take_blocks(first, count, *longest, on_page);
}

// Each page is a file of the run that the directory told last.
Task<Answer<Done>> InsClient::read_files(std::uint32_t first, std::uint32_t count, OnPage on_page) {
  const profile::Raw& raw = profile_->raw;
  for (std::uint32_t page = first; page < first + count; ++page) {
    const std::string name = profile::file_name(raw.file, run_held_, page);
    const Answer<Bytes> response = co_await ask(uds::file_request(name), longest_other);
    if (!response) {
      co_return tl::unexpected(response.error());
    }
    const auto file = uds::read_file_response(*response);
    if (!file) {
      co_return protocol_error(port_, file.error());
    }
    if (file->bytes != raw.page.bytes) {
      co_return protocol_error(
          port_, {ErrorKind::device, fmt::format("RequestFileTransfer: {} has {} bytes, a page has {}", name,
                                                 file->bytes, raw.page.bytes)});
    }
    const auto taken = co_await take_blocks(page, 1, file->longest, on_page);
    if (!taken) {
      co_return taken;
    }
  }
  co_return Done{};
}

// Of a transfer that has begun, to its end.
Task<Answer<Done>> InsClient::take_blocks(std::uint32_t first, std::uint32_t count, std::uint32_t longest,
                                          const OnPage& on_page) {
  const std::size_t page_bytes = profile_->raw.page.bytes;
  const std::size_t wanted = std::size_t{count} * page_bytes;
  Bytes data;
  data.reserve(wanted);
  std::uint32_t whole = 0;
  for (std::uint8_t block = 1; data.size() < wanted; ++block) {
    const Answer<Bytes> part = co_await next_block(block, longest);
    if (!part) {
      co_return tl::unexpected(part.error());
    }
    const std::size_t left = wanted - data.size();
    if (part->size() > left || part->size() < std::min(least_block_data, left)) {
      co_return protocol_error(
          port_, {ErrorKind::device, fmt::format("TransferData: a block of {} bytes, {} to {} expected", part->size(),
                                                 std::min(least_block_data, left), left)});
    }
    data.insert(data.end(), part->begin(), part->end());
    for (; (whole + 1) * page_bytes <= data.size(); ++whole) {
      on_page(first + whole, page_as_kept(*profile_, std::span(data).subspan(whole * page_bytes, page_bytes)));
    }
  }
  const Answer<Bytes> response = co_await ask(uds::transfer_exit_request(), longest_other);
  if (!response) {
    co_return tl::unexpected(response.error());
  }
  co_return Done{};
}

}  // namespace selfcal
