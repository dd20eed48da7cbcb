// The layer container, the catalogue of the archive, and what of the profile stands in none of them.
#include <fmt/format.h>

#include "protocol/odx/communication.hpp"
#include "protocol/odx/odx.hpp"
#include "protocol/odx/services.hpp"
#include "protocol/profile/names.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal::odx {
namespace {

using profile::Profile;

std::string axes_words(const profile::Raw& raw) {
  constexpr std::string_view imu[] = {"x", "y", "z"}, gimbal[] = {"outer", "inner"};
  std::string words = "axes: ours are the INS's";
  for (std::size_t k = 0; k < 3; ++k) {
    words += fmt::format(" {}{}", raw.sign[k] < 0 ? "-" : "", imu[raw.axis[k]]);
  }
  for (std::size_t k = 0; k < 2; ++k) {
    words += fmt::format("{} {}{}", k == 0 ? ", gimbal" : "", raw.gimbal_sign[k] < 0 ? "-" : "", gimbal[raw.gimbal[k]]);
  }
  return words;
}

void tell_lost(const Profile& p, std::vector<std::string>& lost) {
  if (p.security.needed) {
    lost.emplace_back(p.security.program ? "security: the program of the user's own that says the key"
                                         : "security: the key is AES-CMAC of the seed");
  }
  if (p.bus.status) {
    lost.push_back(fmt::format("bus: the status frames 0x{:X} and 0x{:X}, which answer no request (selfcal device dbc)",
                               *p.bus.status, *p.bus.status + 1));
  }
  if (p.bus.fd) {
    lost.emplace_back("bus: CAN FD, of which ODX 2.2 has no parameter");
  }
  if (p.bus.request_byte) {
    lost.emplace_back("bus: whether the address byte is extended or mixed addressing; it stands as extended");
  }
  for (const auto& [name, record] :
       {std::pair("state", &p.state), std::pair("site", &p.site), std::pair("directory", &p.directory),
        std::pair("sample_format", &p.sample_format)}) {
    for (const auto& [field, value] : record->given) {
      lost.push_back(fmt::format("{}: {} is {:.12g}, which the INS does not tell", name, field, value));
    }
  }
  lost.emplace_back(p.stream.empty()
                        ? "page: where the samples stand, for a page comes in several blocks"
                        : "stream: the frames of the samples, which answer no request (selfcal device dbc)");
  for (const auto& [did, region] : p.memory.regions) {
    const bool reads = region.bytes > p.memory.longest_read;
    if (reads || (profile::is_written(p, did) && region.bytes > p.memory.longest_write)) {
      lost.push_back(fmt::format("{}: how it is {} in parts, by {}", profile::did_name(p, did),
                                 reads ? "read" : "written",
                                 uds::service_name(reads ? uds::service::read_memory : uds::service::write_memory)));
    }
  }
  lost.push_back(axes_words(p.raw));
  if (p.set_form != profile::SetForm::errors) {
    lost.push_back(fmt::format("coefficients: the 24 are those of the {}, not of the errors",
                               profile::set_forms[static_cast<std::size_t>(p.set_form)]));
  }
  lost.emplace_back(p.slots ? "coefficients: the order erase, write, commit, restart, and what each may take"
                            : "coefficients: there is one set, used from the next power-on on");
}

std::string container_text(const Profile& p, Export& made) {
  pugi::xml_document document;
  const std::string name = short_name(p.name);
  Node container = add_named(begin_odx(document), "DIAG-LAYER-CONTAINER", "CONTAINER." + name, name + "_container");
  Node protocol = add_named(add(container, "PROTOCOLS"), "PROTOCOL", "PROTOCOL", protocol_name);
  refer(protocol, "COMPARAM-SPEC-REF", parameters_name, parameters_name, "COMPARAM-SPEC");
  Node layer = add_named(add(container, "BASE-VARIANTS"), "BASE-VARIANT", "LAYER." + name, name,
                         "An INS that selfcal calibrates, from its profile.");
  Dictionary dictionary(add(layer, "DIAG-DATA-DICTIONARY-SPEC"), made.lost);
  Layer parts;
  parts.services = add(layer, "DIAG-COMMS");
  parts.requests = add(layer, "REQUESTS");
  parts.responses = add(layer, "POS-RESPONSES");
  parts.refusals = add(layer, "NEG-RESPONSES");
  made.services = write_services(p, parts, dictionary);
  dictionary.end();
  write_parameters(add(layer, "COMPARAM-REFS"), p);
  Node parent = add(add(layer, "PARENT-REFS"), "PARENT-REF");
  attribute(parent, "ID-REF", "PROTOCOL");
  attribute(parent, "xsi:type", "PROTOCOL-REF");
  return text_of(document);
}

std::string catalogue_text(const Profile& p, const Export& made) {
  pugi::xml_document document;
  Node declaration = document.append_child(pugi::node_declaration);
  attribute(declaration, "version", "1.0");
  attribute(declaration, "encoding", "UTF-8");
  Node root = add(document, "CATALOG");
  attribute(root, "F-DTD-VERSION", "ODX-2.2.0");
  attribute(root, "xmlns:xsi", "http://www.w3.org/2001/XMLSchema-instance");
  attribute(root, "xsi:noNamespaceSchemaLocation", "odx-cc.xsd");
  add(root, "SHORT-NAME", short_name(p.name));
  Node blocks = add(root, "ABLOCKS");
  for (const auto& [file, text] : made.files) {
    Node block = add(blocks, "ABLOCK");
    attribute(block, "UPD", "UNCHANGED");
    add(block, "SHORT-NAME", short_name(file));
    Node entry = add(add(block, "FILES"), "FILE", file);
    attribute(entry, "MIME-TYPE", fmt::format("application/x-asam.odx.{}", file.substr(file.rfind('.') + 1)));
  }
  return text_of(document);
}

}  // namespace

Expected<Export> export_profile(const Profile& profile) {
  if (profile.frames) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: the INS speaks no UDS, and ODX describes nothing else; its frames: selfcal device dbc",
                            profile.file));
  }
  Export made;
  std::string container = container_text(profile, made);
  tell_lost(profile, made.lost);
  made.files = {{short_name(profile.name) + ".odx-d", std::move(container)},
                {std::string(parameters_name) + ".odx-c", parameters_text()},
                {"ISO_15765_2.odx-cs", transport_text()},
                {"ISO_15765_3.odx-cs", timing_text()}};
  made.files.emplace_back("index.xml", catalogue_text(profile, made));
  return made;
}

}  // namespace selfcal::odx
