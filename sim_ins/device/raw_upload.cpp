#include "sim_ins/device/raw_upload.hpp"

#include <algorithm>

#include "protocol/profile/raw_file.hpp"
#include "protocol/profile/records.hpp"

namespace selfcal::sim {

using uds::Nrc;
using uds::Reply;

void RawUpload::forget() {
  upload_.reset();
  pages_served_ = 0;
}

Reply RawUpload::request(std::span<const std::uint8_t> request) {
  const profile::Raw& raw = profile_->raw;
  const auto range = uds::parse_upload_request(request, {raw.address_bytes, raw.size_bytes});
  if (!range) {
    return tl::unexpected(range.error());
  }
  const ins::DirectoryRecord directory = raw_.directory();
  const std::uint32_t first_page = raw.by_page ? range->address : range->address / page_bytes();
  const std::uint64_t end = std::uint64_t{first_page} * page_bytes() + range->bytes;
  const bool between_pages = !raw.by_page && range->address % page_bytes() != 0;
  if (range->bytes == 0 || between_pages || first_page < directory.first_page ||
      end > std::uint64_t{directory.pages_written} * page_bytes()) {
    return tl::unexpected(Nrc::request_out_of_range);
  }
  upload_ = Upload{first_page, range->bytes, 0, 1, 0};
  told_.reset();
  return uds::upload_response(longest_response_);
}

Reply RawUpload::file(std::span<const std::uint8_t> request) {
  const auto name = uds::parse_file_request(request);
  if (!name) {
    return tl::unexpected(name.error());
  }
  const ins::DirectoryRecord directory = raw_.directory();
  const auto page = profile::page_of_file(profile_->raw.file, directory.run_id, *name);
  if (!page || *page < directory.first_page || *page >= directory.pages_written) {
    return tl::unexpected(Nrc::request_out_of_range);
  }
  upload_ = Upload{*page, page_bytes(), 0, 1, 0};
  told_.reset();
  return uds::file_response(longest_response_, page_bytes());
}

// A request that is refused changes nothing: the last block can still be asked for again.
Reply RawUpload::transfer(std::span<const std::uint8_t> request, uds::Bytes& response) {
  if (request.size() != 2) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  if (!upload_) {
    return tl::unexpected(Nrc::request_sequence_error);
  }
  Upload next = *upload_;
  const std::uint8_t block = request[1];
  if (block == static_cast<std::uint8_t>(next.next_block - 1) && next.last_size > 0) {
    next.done -= next.last_size;  // the block before, asked for again
  } else if (block == next.next_block) {
    ++next.next_block;
  } else {
    return tl::unexpected(Nrc::wrong_block_sequence_counter);
  }
  const auto room = longest_response_ - static_cast<std::uint32_t>(uds::transfer_overhead);
  next.last_size = std::min(room, next.bytes - next.done);
  if (next.last_size == 0) {  // all of it was handed over
    return tl::unexpected(Nrc::request_sequence_error);
  }
  uds::transfer_response(block, data(next), response);
  next.done += next.last_size;
  upload_ = next;
  pages_served_ = std::max(pages_served_, next.first_page + next.done / page_bytes());
  return uds::Bytes{};
}

// A page that the FLASH does not hold whole reads as erased.
std::span<const std::uint8_t> RawUpload::told_page(std::uint32_t page) {
  if (!told_ || told_->first != page) {
    flash::Page content;
    const auto whole = flash::decode_page(raw_.page(page), content);
    auto bytes = whole ? profile::encode_page(*profile_, content) : uds::Bytes();
    told_.emplace(page, bytes && !bytes->empty() ? std::move(*bytes) : uds::Bytes(page_bytes(), 0xFF));
  }
  return told_->second;
}

uds::Bytes RawUpload::data(const Upload& upload) {
  uds::Bytes data;
  data.reserve(upload.last_size);
  const std::uint32_t end = upload.done + upload.last_size;
  for (std::uint32_t at = upload.done; at < end;) {
    const std::uint32_t page = upload.first_page + at / page_bytes();
    const std::uint32_t part = std::min(page_bytes() - at % page_bytes(), end - at);
    const auto bytes = told_page(page).subspan(at % page_bytes(), part);
    data.insert(data.end(), bytes.begin(), bytes.end());
    if (raw_.spoilt() == page && part > 64) {
      data.back() ^= 0x40;
      raw_.mend();
    }
    at += part;
  }
  return data;
}

Reply RawUpload::memory(std::span<const std::uint8_t> request) {
  const profile::Raw& raw = profile_->raw;
  const auto range = uds::parse_memory_request(request, {raw.address_bytes, raw.size_bytes});
  if (!range) {
    return tl::unexpected(range.error());
  }
  const ins::DirectoryRecord directory = raw_.directory();
  const std::uint64_t begin = raw.first_address + std::uint64_t{directory.first_page} * page_bytes();
  const std::uint64_t end = raw.first_address + std::uint64_t{directory.pages_written} * page_bytes();
  if (range->bytes == 0 || range->bytes > raw.longest_read || range->address < begin ||
      std::uint64_t{range->address} + range->bytes > end) {
    return tl::unexpected(Nrc::request_out_of_range);
  }
  const std::uint32_t at = range->address - raw.first_address;
  Reply reply = uds::memory_response(data(Upload{0, at + range->bytes, at, 1, range->bytes}));
  pages_served_ = std::max(pages_served_, (at + range->bytes) / page_bytes());
  return reply;
}

Reply RawUpload::exit(std::span<const std::uint8_t> request) {
  if (request.size() != 1) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  if (!upload_ || upload_->done < upload_->bytes) {
    return tl::unexpected(Nrc::request_sequence_error);
  }
  upload_.reset();
  return uds::transfer_exit_response();
}

}  // namespace selfcal::sim
