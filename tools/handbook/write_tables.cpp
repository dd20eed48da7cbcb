// The handbook's pages that are made from the programs' own tables: `selfcal_write_handbook FOLDER`. The pages are kept
// beside this file; ctest -R documents.generated compares them with what this program writes.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <set>
#include <string>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/passes/calibration.hpp"
#include "protocol/isotp/transport.hpp"
#include "protocol/profile/coefficient_fields.hpp"
#include "protocol/profile/describe.hpp"
#include "protocol/profile/frames.hpp"
#include "protocol/profile/roles.hpp"
#include "protocol/uds/client.hpp"
#include "protocol/uds/server.hpp"
#include "sim_ins/config.hpp"
#include "sim_ins/physics.hpp"

namespace {

using namespace selfcal;

std::string made_from(std::string_view source) {
  return fmt::format("<!-- Made by selfcal_write_handbook from {}. Change that, not this page. -->\n\n", source);
}

std::string words(const diagnosis::Effect& e) {
  if (e.parameters.empty()) {
    return "-";
  }
  // Parameters of one unit and size stand together: "x y z: 50 ug".
  std::string text;
  for (std::size_t first = 0; first < e.parameters.size();) {
    const diagnosis::EffectParameter& p = e.parameters[first];
    std::size_t end = first;
    std::string names;
    while (end < e.parameters.size() && e.parameters[end].unit == p.unit && e.parameters[end].typical == p.typical) {
      names += (names.empty() ? "" : " ") + e.parameters[end++].name;
    }
    text += fmt::format("{}`{}`: {:g} {}", text.empty() ? "" : "; ", names, p.typical, p.unit);
    first = end;
  }
  return text;
}

std::string effects_page() {
  std::string text = "# Catalogue of effects\n\n" + made_from("estimator/diagnosis and sim_ins/physics.cpp");
  text +=
      R"(An effect is physics that the 24 parameters leave out. `selfcal diagnose` names effects by these ids, and a physics file
conceals them in a simulation. In the equations *i* is a sensor axis, *u* the specific force over g, *f* the specific force, *w*
the angular rate, *A* the angle that the gimbal turned lately, *s* the time since the end of the last turn, *t* the time since the
start, *T* the temperature less its mean. `df` and `dw` add to the sensor's output. The typical size is what such sensors show; the
diagnosis states for each recording with which significance it would see that size (`expected_z` in its JSON).

## Effects that the diagnosis names

)";
  for (const diagnosis::Effect& e : diagnosis::catalogue()) {
    text += fmt::format("### {}{}\n\n", e.id,
                        e.temperature == diagnosis::TemperatureUse::measured ? " (with a temperature channel)" : "");
    text += fmt::format("    {}\n\n- coefficients and typical size: {}\n", e.equation, words(e));
    if (e.constant.kind != diagnosis::EffectConstant::Kind::none) {
      text += fmt::format("- constant: `{}` in {}, fitted\n", e.constant.name, e.constant.unit);
    }
    text += fmt::format("- where it shows: {}\n- what tells it from its rivals: {}\n\n", e.excited, e.experiment);
  }
  text +=
      R"(The diagnosis also reports the stochastic part (`gyro_noise_level`, `accel_noise_level`, `gyro_random_walk`,
`accel_random_walk`, `gyro_bias_instability`, `accel_bias_instability`, `quantisation`, `vibration_line`) and faults of the data, such as `lost_samples`.

## Keys of a physics file

A physics file conceals effects in `selfcal simulate` and `sim_ins`: `[[effect]]`, an `id`, and any of these keys. A key that is
left out has the value of the last column. Several effects add up.

| id | key | unit | if left out |
|---|---|---|---|
)";
  for (const sim::EffectDescription& e : sim::physics_effects()) {
    for (std::size_t first = 0; first < e.parameters.size();) {
      const sim::EffectParameter& p = e.parameters[first];
      const std::string id =
          first > 0 ? "" : fmt::format("`{}`{}", e.id, e.in_catalogue ? "" : " (not in the catalogue)");
      std::string keys;
      for (; first < e.parameters.size() && e.parameters[first].unit == p.unit &&
             e.parameters[first].default_value == p.default_value;
           ++first) {
        keys += fmt::format("{}`{}`", keys.empty() ? "" : " ", e.parameters[first].name);
      }
      text += fmt::format("| {} | {} | {} | {:g} |\n", id, keys, p.unit, p.default_value);
    }
  }
  return text;
}

std::string milliseconds(Time time) {
  return fmt::format("{} ms", std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
}

// Sections of the document of a profile, without its title.
std::string own_interface() {
  const std::string document = profile::describe(*profile::built_in(), profile::Markup::markdown);
  const std::size_t first = document.find("\n## ");
  return document.substr(first + 1);
}

std::string interface_page() {
  std::string text = "# INS interface\n\n" + made_from("config/profiles/selfcal.toml");
  text +=
      R"(How the service speaks to our own INS, and to the virtual one: UDS (ISO 14229-1) over ISO-TP (ISO 15765-2) on classic CAN or CAN
FD. `selfcal device describe` writes such a page for any [profile](profile.md). `config/selfcal.dbc` holds the status frames for
CAN tools. An INS has other identifiers by its profile, or by `request_id`, `response_id`, `functional_id` and `status_id` in its
section of the service's configuration.

)";
  text += own_interface();
  const uds::ServerTimings server;
  const uds::ClientTimings client;
  const isotp::Options transport;
  text += "\n## Timing\n\n| time | value | meaning |\n|---|---|---|\n";
  text += fmt::format("| P2 (INS) | {} | the virtual INS answers within it, or says response-pending |\n",
                      milliseconds(server.p2));
  text += fmt::format("| P2* (INS) | {} | the same after response-pending |\n", milliseconds(server.p2_star));
  text += fmt::format("| S3 | {} | without a request: default session, locked |\n", milliseconds(server.s3));
  text += fmt::format(
      "| P2 (tester) | {} | to the first frame of the answer, bus delay included; key `request_timeout_s` sets it for "
      "an INS, and it grows where the INS states that it takes longer |\n",
      milliseconds(client.p2));
  text += fmt::format("| response-pending | {} | altogether, for one request |\n", milliseconds(client.pending_limit));
  text += fmt::format("| TesterPresent | {} | interval |\n", milliseconds(client.tester_present));
  text += fmt::format("| N_As, N_Bs, N_Cr | {}, {}, {} | of ISO 15765-2 |\n", milliseconds(transport.n_as),
                      milliseconds(transport.n_bs), milliseconds(transport.n_cr));
  text += R"(
## Unlocking

Level 1 of SecurityAccess gives a seed of 16 bytes; the key is AES-CMAC-128 of the seed (NIST SP 800-38B, RFC 4493) with the secret
of the INS, 32 hexadecimal digits in the key file.
)";
  return text;
}

std::string parameters_page() {
  std::string text = "# The 24 parameters\n\n" + made_from("estimator/geometry/sensor_parameters and estimator/passes");
  text +=
      R"(Names, units and order are the same in every file, document and record. The tolerance is the largest sigma with which a
parameter counts as determined where nothing else is configured. [Frames and signs](frames-and-signs.md) has the equations.

| name | unit | SI value of the unit | default tolerance (sigma) |
|---|---|---|---|
)";
  const CalibrationOptions options;
  for (std::size_t k = 0; k < sensor_parameters.size(); ++k) {
    const SensorParameter& p = sensor_parameters[k];
    text += fmt::format("| `{}` | {} | {:.9g} | {:.4g} |\n", p.name, p.unit, p.si_per_unit,
                        options.tolerance(static_cast<Eigen::Index>(k)) / p.si_per_unit);
  }
  return text;
}

std::string fields_table(const profile::RecordRole& role) {
  std::string text = "| field | unit here | needed | meaning |\n|---|---|---|---|\n";
  for (const profile::RoleField& f : role.fields) {
    std::string meaning(f.meaning);
    if (!f.words.empty()) {
      meaning += fmt::format(": `codes` for {}", fmt::join(f.words, ", "));
    }
    text += fmt::format("| {}`{}`{} | {} | {} | {} |\n", f.repeated ? "each: " : "", f.name,
                        f.count > 1 ? fmt::format(" x {}", f.count) : "", f.text ? "text" : f.unit,
                        f.needed ? "yes" : "", meaning);
  }
  return text + "\n";
}

std::string profile_page() {
  std::string text = "# Profile\n\n" + made_from("protocol/profile/roles");
  text +=
      R"(What an INS speaks, in TOML. [Your INS in an hour](your-ins.md) shows how one is made, `selfcal device lint` tells what is wrong with
it, and `config/profiles` holds six. Unknown keys are faults.

| table | keys |
|---|---|
| | `name`; `byte_order` big or little, of every number that says nothing else |
| `bus` | `addressing` normal, normal-29 (with `request`, `response`, `functional`), normal-fixed (with `ins_address`, `tester_address`), extended, extended-29 (with the three identifiers, of which requests to one and to all may be the same, and `ins_address`, `tester_address`, `functional_address`), mixed (with the three identifiers and `address_extension`), mixed-29 (with `ins_address`, `tester_address`, `address_extension`), none (no UDS, with `extended_ids`: see `frames`); `status` of the [state frame](#status-frames), the gimbal frame has the next, none where it is left out; `fd`; `padding`, `block_size`, `st_min` |
| `timing` | `request_timeout_s`, `p2_star_s`, `tester_present_s`; what the INS states lengthens them. How long the INS may take: `erase_s` (8 s where it is left out), `write_s` a set (4), `commit_s` (4), and on its own clock `restart_s` (60), `stop_s` of the gimbal (30) |
| `session` | `calibration`: the session in which it writes, 3 where it is left out |
| `security` | `method` aes-cmac, program or none; `level` of requestSeed, odd. Of a program: `program`, from the folder of the profile on; `seed` stdin or argument, stdin where it is left out; `seed_bytes`, `key_bytes`; `limit_s`, 5 s where it is left out |
| `identity` | `serial`, `software`: data identifiers of ASCII, or places in memory: `{ memory = ADDRESS, bytes = LENGTH }` |
| `state`, `schedule`, `site`, `directory`, `sample_format` | `did`, or `memory`: its address, and a record; `site` may be left out where the configuration gives it |
| `move` | in place of `schedule`, where the INS is told each position by itself: `did`, `memory` or `routine`, a record; `there` angle (with `tolerance_deg`, and `rest_deg`: it rests while `outer` and `inner` of the state stay so near, 0.05 where it is left out) or state (`gimbal_moving` of the state); `longest_s` of a move, 60 where it is left out. `rotate` then records from its start to its stop, and the directory need not tell `pages_expected` |
| `coefficients` | `in_force`, `inactive`, `factory`: data identifiers, or places in memory: `{ memory = ADDRESS }`; a record. `slots = false`: one set, `in_force`, is written over. `field_by_field = true`, without slots: each field has `did` or `memory` in place of `at`. `form`: what the 24 mean, errors where it is left out, correction or correction-first ([Your INS](your-ins.md)) |
| `rotate`, `erase`, `commit`, `navigation_check` | `routine`: its identifier; `start`, `result`: records. All but `rotate` may be left out |
| `upload` | RequestUpload: `address` page or byte; `address_bytes`, `size_bytes` |
| `memory` | how the INS's memory is asked for: `address_bytes` (4 where it is left out), `size_bytes` (2), bytes that it tells at once, `longest`, and takes, `longest_write` (as many where it is left out). With `address`, raw data by ReadMemoryByAddress in the place of RequestUpload: where the run's first page begins; `end` is the first address behind them, that behind all addresses where it is left out |
| `file` | RequestFileTransfer in its place, each page a file: `name`, with `{page}` and perhaps `{run}`; `{page:6}` has six digits at least |
| `stream` | the samples in CAN frames while it rotates, in its place: `dbc` and `sample.NAME` as of [plain frames](#plain-frames); then there are no `directory` and no `page` |
| `frames` | of an INS without UDS, [below](#plain-frames) |
| `page` | a record |
| `axes` | `imu`, `gimbal`: ours, in the INS's words, `-` for the other way round |

## A record

| key | is |
|---|---|
| `bytes` | of the whole record; left out where it is as long as its repetitions |
| `fill` | bytes that no field has, 0 where it is left out |
| `fields.NAME` | one field |
| `each.at`, `each.stride`, `each.count`, `each.most` | what is repeated: its first byte, its length, the field that counts it, how many there can be |
| `each.fields.NAME` | a field of each repetition, `at` from its beginning |
| `checksum` | `at`, `type`, `algorithm` crc32c, crc32 or crc16, `from`, `to`: bytes from `from` to `to` - 1, its own as 0 |
| `given` | numbers that the INS does not tell because they are always the same |

## Plain frames

With `addressing = "none"` a message is a CAN frame and its fields are signals. Of the tables above only `bus`, `timing` (`request_timeout_s`),
`sample_format` (`given`), `coefficients` (each field has `index` in place of `at`, and as many bits as the signal `value`) and `axes` remain.

| table | keys |
|---|---|
| `frames` | `dbc`: a DBC that frames may name, from the folder of the profile on |
| `frames.turning` | `there` angle (with `tolerance_deg`, and `rest_deg`: it rests while its angles stay so near, 0.05 where it is left out) or state; `longest_s` of a move |
| `frames.identity`, `frames.state`, `frames.told` | what the INS tells |
| `frames.move`, `frames.read`, `frames.write`, `frames.reset`; `frames.start`, `frames.stop` may be left out | what it is told; those with one `id` are told apart by a constant |
| `frames.sample.NAME` | a sample, or a part of it: each part has the sample's `counter` |

A frame: `id` and `bytes`, or `message` of the DBC; `signals.NAME`. A signal: `start`, `length`, `byte_order` as in a DBC, `type` (unsigned, signed,
float), or `of` with the DBC's name; `scale`, `offset`, `unit`, `codes`, `constant` as of a field, before what the DBC says.

## Status frames

`status.state` and `status.gimbal` say what stands in the frames that an INS sends again and again beside UDS: `bytes` and
`signals.NAME`, as of a plain frame. Their identifiers are `bus.status` and the next one. Where the table is left out, they are as our
own INS's.

)";
  for (const std::string_view name : {"status.state", "status.gimbal"}) {
    text += fmt::format("### {}\n\n| signal | unit here | needed | meaning |\n|---|---|---|---|\n", name);
    for (const profile::RoleField& f : profile::frame_role(name).signals) {
      text += fmt::format("| `{}` | {} | {} | {}{} |\n", f.name, f.unit, f.needed ? "yes" : "", f.meaning,
                          f.words.empty() ? "" : fmt::format(": `codes` for {}", fmt::join(f.words, ", ")));
    }
    text += "\n";
  }
  text += R"(## A field

A field: `at` (byte, from 0), `type` (u8 u16 u24 u32 u64 i8 i16 i24 i32 i64 f32 f64, ascii with `length`), `count` (elements, one behind
the other), `byte_order`, `first_bit` and `bits` (part of an unsigned integer, 0 the lowest), `scale`, `offset` (value = number times
`scale` plus `offset`, in `unit`), `codes` (words to numbers), `constant` (always this; then any name will do). Of a scale factor
`nominal` in place of `unit`: the field tells nominal (1 + value), of K⁻ nominal (1 - value), in a unit of its own.

)";
  std::string known;
  for (const profile::Unit& unit : profile::units()) {
    if (!unit.name.empty()) {
      known += fmt::format("{}{}", known.empty() ? "" : ", ", unit.name);
    }
  }
  text += fmt::format("Units: {}. A field without one has the unit of its role.\n\n", known);
  for (const profile::RecordRole& role : profile::record_roles()) {
    text += fmt::format("## {}\n\n{}{}.\n\n", role.table, role.meaning, role.needed ? "" : "; may be left out");
    text += fields_table(role.table == profile::set_role().table ? profile::set_role() : role);
  }
  return text.substr(0, text.size() - 1);
}

bool write(const std::string& folder, const char* file, const std::string& text) {
  std::ofstream out(folder + "/" + file);
  out << text;
  out.close();
  if (!out) {
    fmt::print(stderr, "selfcal_write_handbook: {}/{}: cannot be written\n", folder, file);
  }
  return out.good();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: selfcal_write_handbook FOLDER\n");
    return 2;
  }
  const bool well = write(argv[1], "effects.md", effects_page()) &&
                    write(argv[1], "ins-interface.md", interface_page()) &&
                    write(argv[1], "parameters.md", parameters_page()) && write(argv[1], "profile.md", profile_page());
  return well ? 0 : 3;
}
