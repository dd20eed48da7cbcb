#include "protocol/odx/services.hpp"

#include <fmt/format.h>

#include "protocol/profile/coefficient_fields.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal::odx {
namespace {

namespace service = uds::service;
using profile::Field;
using profile::Layout;
using profile::Profile;

constexpr std::size_t byte_bits = 8, did_bits = 16;
constexpr std::size_t record_at = 3, result_at = 4;  // behind service and identifier; behind the sub-function too

class Services {
 public:
  Services(const Profile& profile, const Layer& layer, Dictionary& dictionary)
      : p_(profile), layer_(layer), dictionary_(dictionary) {}

  std::size_t write() {
    write_refusal();
    write_sessions();
    write_security();
    write_identifiers();
    write_routines();
    write_raw_data();
    write_small("restart", service::ecu_reset, 1, "FUNCTION");
    write_small("tester_present", service::tester_present, 0, "TESTERPRESENT");
    return count_;
  }

 private:
  struct Messages {
    Node request, response;
  };

  // A service whose request begins with one byte and, if there is one, a number.
  Messages begin(const std::string& name, const char* semantic, std::uint8_t id, std::string_view words) {
    Node node = add(layer_.services, "DIAG-SERVICE");
    attribute(node, "ID", "SERVICE." + name);
    attribute(node, "SEMANTIC", semantic);
    attribute(node, "ADDRESSING", "PHYSICAL");
    odx::name(node, name, words);
    refer(node, "REQUEST-REF", "REQUEST." + name);
    refer(add(node, "POS-RESPONSE-REFS"), "POS-RESPONSE-REF", "RESPONSE." + name);
    refer(add(node, "NEG-RESPONSE-REFS"), "NEG-RESPONSE-REF", "REFUSAL");
    ++count_;
    Messages messages{
        add(add_named(layer_.requests, "REQUEST", "REQUEST." + name, "request_" + name), "PARAMS"),
        add(add_named(layer_.responses, "POS-RESPONSE", "RESPONSE." + name, "response_" + name), "PARAMS")};
    add_coded_constant(messages.request, "service", "SERVICE-ID", 0, byte_bits, id);
    add_coded_constant(messages.response, "service", "SERVICE-ID", 0, byte_bits, id + uds::positive_offset);
    return messages;
  }
  static void both(const Messages& m, std::string_view name, const char* semantic, std::size_t at, std::size_t bits,
                   std::uint64_t value) {
    add_coded_constant(m.request, name, semantic, at, bits, value);
    add_coded_constant(m.response, name, semantic, at, bits, value);
  }
  void value(Node params, std::string_view name, std::size_t at, const std::string& property,
             std::string_view words = {}) {
    refer(add_parameter(params, "VALUE", name, "DATA", at, 0, words), "DOP-REF", property);
  }

  void write_refusal() {
    Node params = add(add_named(layer_.refusals, "NEG-RESPONSE", "REFUSAL", "refusal"), "PARAMS");
    add_coded_constant(params, "service", "SERVICE-ID", 0, byte_bits, service::negative_response);
    Node which = add_parameter(params, "MATCHING-REQUEST-PARAM", "of_service", "SERVICEIDRQ", 1);
    add(which, "REQUEST-BYTE-POS", "0");
    add(which, "BYTE-LENGTH", "1");
    std::map<std::uint64_t, std::string> codes;
    for (unsigned code = 1; code <= 0xFF; ++code) {
      if (const auto name = uds::nrc_name(static_cast<std::uint8_t>(code)); name != "unknown") {
        codes.emplace(code, name);
      }
    }
    value(params, "code", 2, dictionary_.words(byte_bits, codes));
  }

  void write_small(const std::string& name, std::uint8_t id, std::uint8_t sub_function, const char* semantic) {
    both(begin(name, semantic, id, {}), "sub_function", "SUBFUNCTION", 1, byte_bits, sub_function);
  }

  void write_sessions() {
    for (const auto& [name, session] :
         {std::pair("session_default", std::uint8_t{1}), std::pair("session_calibration", p_.session)}) {
      const Messages m = begin(name, "SESSION", service::session_control, "locks");
      both(m, "session", "SUBFUNCTION", 1, byte_bits, session);
      value(m.response, "p2_ms", 2, dictionary_.number(did_bits));
      value(m.response, "p2_star_10_ms", 4, dictionary_.number(did_bits));
    }
  }

  void write_security() {
    const profile::Security& security = p_.security;
    if (!security.needed) {
      return;
    }
    const Messages seed = begin("security_seed", "SECURITY", service::security_access, "all zeros: open already");
    both(seed, "level", "SUBFUNCTION", 1, byte_bits, security.level);
    value(seed.response, "seed", 2, dictionary_.bytes(security.seed_bytes));
    const Messages key = begin("security_key", "SECURITY", service::security_access, {});
    both(key, "level", "SUBFUNCTION", 1, byte_bits, security.level + 1U);
    value(key.request, "key", 2, dictionary_.bytes(security.key_bytes));
  }

  void write_identifier(const std::string& name, std::uint16_t did, const std::string& content, bool written) {
    read_identifier(name, did, content);
    if (written) {
      write_to_identifier(name, did, content);
    }
  }

  void read_identifier(const std::string& name, std::uint16_t did, const std::string& content) {
    if (const profile::Region* region = p_.memory.find(did)) {
      return read_region(name, *region, content);
    }
    const Messages read = begin("read_" + name, "CURRENTDATA", service::read_data, {});
    both(read, "identifier", "ID", 1, did_bits, did);
    value(read.response, "record", record_at, content);
  }

  void write_to_identifier(const std::string& name, std::uint16_t did, const std::string& content) {
    if (const profile::Region* region = p_.memory.find(did)) {
      return write_region(name, *region, content);
    }
    const Messages write = begin("write_" + name, "STOREDDATA", service::write_data, {});
    both(write, "identifier", "ID", 1, did_bits, did);
    value(write.request, "record", record_at, content);
  }

  // A record in memory, where it is told and taken at once: its address and size always the same.
  void add_place(Node params, const profile::Region& region) const {
    const profile::RecordMemory& memory = p_.memory;
    add_coded_constant(params, "address_and_length_format", "DATA", 1, byte_bits,
                       memory.size_bytes << 4U | memory.address_bytes);
    add_coded_constant(params, "address", "DATA", 2, byte_bits * memory.address_bytes, region.address);
    add_coded_constant(params, "size", "DATA", 2 + memory.address_bytes, byte_bits * memory.size_bytes, region.bytes);
  }

  void read_region(const std::string& name, const profile::Region& region, const std::string& content) {
    if (region.bytes <= p_.memory.longest_read) {
      const Messages read = begin("read_" + name, "CURRENTDATA", service::read_memory, {});
      add_place(read.request, region);
      value(read.response, "record", 1, content);
    }
  }

  void write_region(const std::string& name, const profile::Region& region, const std::string& content) {
    if (region.bytes <= p_.memory.longest_write) {
      const Messages write = begin("write_" + name, "STOREDDATA", service::write_memory, {});
      add_place(write.request, region);
      add_place(write.response, region);
      value(write.request, "record", 2 + p_.memory.address_bytes + p_.memory.size_bytes, content);
    }
  }

  // A position, by a write or as the option of a routine.
  void write_move() {
    if (!p_.move) {
      return;
    }
    const auto& role = profile::record_role("move");
    if (p_.move->did) {
      return write_to_identifier("move", *p_.move->did, dictionary_.structure("move", p_.move->layout, role));
    }
    const Messages m = begin("start_move", "ROUTINE", service::routine_control, "turns the gimbal to a position");
    both(m, "action", "SUBFUNCTION", 1, byte_bits, static_cast<std::uint64_t>(uds::RoutineAction::start));
    both(m, "routine", "ID", 2, did_bits, *p_.move->routine);
    value(m.request, "option", result_at, dictionary_.structure("move_option", p_.move->layout, role));
  }

  void write_identifiers() {
    write_identifier("serial_number", p_.serial, dictionary_.rest(true), false);
    write_identifier("software_version", p_.software, dictionary_.rest(true), false);
    for (const auto& [name, record] :
         {std::pair("state", &p_.state), std::pair("schedule", &p_.schedule), std::pair("site", &p_.site),
          std::pair("directory", &p_.directory), std::pair("sample_format", &p_.sample_format)}) {
      if (record->did && record->did != profile::kept_directory) {
        const std::string id = dictionary_.structure(name, record->layout, profile::record_role(name));
        write_identifier(name, *record->did, id, record == &p_.schedule);
      }
    }
    write_move();
    if (p_.field_by_field) {
      return write_fields();
    }
    const std::string set = dictionary_.structure("coefficients", p_.set, profile::set_role());
    write_identifier("coefficients_in_force", *p_.set_in_force, set, !p_.slots);
    if (p_.set_inactive) {
      write_identifier("coefficients_inactive", *p_.set_inactive, set, true);
    }
    if (p_.set_factory) {
      write_identifier("coefficients_factory", *p_.set_factory, set, false);
    }
  }

  // Each field of the set is a record of its own.
  void write_fields() {
    for (const Field& field : p_.set.fields) {
      Layout alone;
      alone.fields.push_back(field);
      alone.fields.front().at = 0;
      alone.bytes = alone.fields.front().end();
      const std::string name = short_name("coefficient_" + field.name);
      write_identifier(name, *field.did, dictionary_.structure(name, alone, profile::set_role()), true);
    }
  }

  void write_routine(const std::string& name, const profile::Routine& routine, bool stops, bool has_result) {
    if (!routine.id) {
      return;
    }
    const auto begin_action = [&](const std::string& what, uds::RoutineAction action) {
      const Messages m = begin(what + "_" + name, "ROUTINE", service::routine_control, {});
      both(m, "action", "SUBFUNCTION", 1, byte_bits, static_cast<std::uint64_t>(action));
      both(m, "routine", "ID", 2, did_bits, *routine.id);
      return m;
    };
    const Messages start = begin_action("start", uds::RoutineAction::start);
    if (!routine.start.fields.empty()) {
      const std::string of = name + ".start";
      value(start.request, "option", result_at,
            dictionary_.structure(name + "_option", routine.start, profile::record_role(of)));
    }
    if (stops) {
      begin_action("stop", uds::RoutineAction::stop);
    }
    if (has_result) {
      const std::string of = name + ".result";
      value(begin_action("result_of", uds::RoutineAction::result).response, "record", result_at,
            dictionary_.structure(name + "_result", routine.result, profile::record_role(of)));
    }
  }

  void write_routines() {
    write_routine("rotate", p_.rotate, true, true);
    write_routine("erase", p_.erase, false, false);
    write_routine("commit", p_.commit, false, false);
    write_routine("navigation_check", p_.navigation_check, true, true);
  }

  void write_raw_data() {
    switch (p_.raw.way) {
      case profile::Raw::Way::memory: return write_memory();
      case profile::Raw::Way::stream: return;  // no service
      case profile::Raw::Way::file: write_file(); break;
      default: write_upload();
    }
    const Messages block = begin("raw_data_block", "UPLOAD", service::transfer_data, "1 first; after 255 comes 0");
    value(block.request, "number", 1, dictionary_.number(byte_bits));
    value(block.response, "number", 1, dictionary_.number(byte_bits));
    value(block.response, "data", 2, dictionary_.rest(false));
    begin("raw_data_end", "UPLOAD", service::transfer_exit, {});
  }

  std::uint64_t format() const { return p_.raw.size_bytes << 4U | p_.raw.address_bytes; }

  void write_upload() {
    const Messages m = begin("raw_data_begin", "UPLOAD", service::request_upload,
                             p_.raw.by_page ? "address: number of a page of the run; size in bytes"
                                            : "address: bytes from the run's first page on; size in bytes");
    add_coded_constant(m.request, "data_format", "DATA", 1, byte_bits, 0);
    add_coded_constant(m.request, "address_and_length_format", "DATA", 2, byte_bits, format());
    value(m.request, "address", 3, dictionary_.number(byte_bits * p_.raw.address_bytes));
    value(m.request, "size", 3 + p_.raw.address_bytes, dictionary_.number(byte_bits * p_.raw.size_bytes));
    add_coded_constant(m.response, "length_format", "DATA", 1, byte_bits, 0x40);
    value(m.response, "longest_block", 2, dictionary_.number(4 * byte_bits));
  }

  void write_memory() {
    const Messages m = begin("raw_data_memory", "UPLOAD", service::read_memory,
                             fmt::format("page 0 of the run begins at {}; {} bytes at most at once",
                                         p_.raw.first_address, p_.raw.longest_read));
    add_coded_constant(m.request, "address_and_length_format", "DATA", 1, byte_bits, format());
    value(m.request, "address", 2, dictionary_.number(byte_bits * p_.raw.address_bytes));
    value(m.request, "size", 2 + p_.raw.address_bytes, dictionary_.number(byte_bits * p_.raw.size_bytes));
    value(m.response, "data", 1, dictionary_.rest(false));
  }

  // The byte behind the name has no fixed place.
  void write_file() {
    const Messages m = begin("raw_data_begin", "UPLOAD", service::file_transfer,
                             fmt::format("each page is a file of this name: {}", p_.raw.file));
    add_coded_constant(m.request, "mode", "SUBFUNCTION", 1, byte_bits, 4);
    value(m.request, "name", 2, dictionary_.counted_text());
    add_coded_constant(m.request, "data_format", "DATA", 0, byte_bits, 0);
    m.request.last_child().remove_child("BYTE-POSITION");
    constexpr std::size_t width = 4;
    add_coded_constant(m.response, "mode", "SUBFUNCTION", 1, byte_bits, 4);
    add_coded_constant(m.response, "length_format", "DATA", 2, byte_bits, width);
    value(m.response, "longest_block", 3, dictionary_.number(width * byte_bits));
    add_coded_constant(m.response, "data_format", "DATA", 7, byte_bits, 0);
    add_coded_constant(m.response, "size_format", "DATA", 8, did_bits, width);
    value(m.response, "size", 10, dictionary_.number(width * byte_bits));
    value(m.response, "size_compressed", 14, dictionary_.number(width * byte_bits));
  }

  const Profile& p_;
  const Layer& layer_;
  Dictionary& dictionary_;
  std::size_t count_ = 0;
};

}  // namespace

std::size_t write_services(const Profile& profile, const Layer& layer, Dictionary& dictionary) {
  return Services(profile, layer, dictionary).write();
}

}  // namespace selfcal::odx
