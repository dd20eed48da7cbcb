#include "daemon/host/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <span>
#include <sstream>

#include "daemon/host/hub_config.hpp"
#include "protocol/profile/read_profile.hpp"
#include "protocol/toml_file/nearest_word.hpp"
#include "protocol/toml_file/toml_text.hpp"

namespace selfcal {
namespace {

// One key: how it is read into the target. `set` returns a complaint, empty if all is well.
template <typename Target>
struct Key {
  std::string_view name;
  std::function<std::string(const toml::node&, Target&)> set;
};

template <typename Target>
Key<Target> text(std::string_view name, std::string Target::*member, bool may_be_empty = false) {
  return {name, [=](const toml::node& node, Target& target) -> std::string {
            const auto value = node.value_exact<std::string>();
            if (!value) {
              return "must be a string";
            }
            if (value->empty() && !may_be_empty) {
              return "must not be empty";
            }
            target.*member = *value;
            return {};
          }};
}

template <typename Target>
Key<Target> number(std::string_view name, double Target::*member, double low, double high) {
  return {name, [=](const toml::node& node, Target& target) -> std::string {
            const auto value = node.value<double>();
            if (!value || node.is_boolean()) {
              return "must be a number";
            }
            if (!(*value >= low && *value <= high)) {
              return fmt::format("is {}, must lie between {} and {}", *value, low, high);
            }
            target.*member = *value;
            return {};
          }};
}

template <typename Target>
Key<Target> flag(std::string_view name, bool Target::*member) {
  return {name, [=](const toml::node& node, Target& target) -> std::string {
            const auto value = node.value_exact<bool>();
            if (!value) {
              return "must be true or false";
            }
            target.*member = *value;
            return {};
          }};
}

template <typename Id>
Key<InsConfig> can_id(std::string_view name, Id InsConfig::*member) {
  return {name, [=](const toml::node& node, InsConfig& ins) -> std::string {
            const auto value = node.value_exact<std::int64_t>();
            if (!value || *value < 0 || *value > 0x1FFFFFFF) {
              return "must be a CAN identifier, 0 to 0x1FFFFFFF";
            }
            ins.*member = static_cast<std::uint32_t>(*value);
            return {};
          }};
}

using Limits = std::array<std::optional<double>, sensor_parameter_count>;

// A table of parameter names, or of groups ("gyro_scale" for its three axes), with a positive figure each.
Key<InsConfig> parameter_figures(std::string_view name, Limits InsConfig::*member) {
  return {name, [=](const toml::node& node, InsConfig& ins) -> std::string {
            if (!node.is_table()) {
              return "must be a table of parameter names";
            }
            for (const auto& [key, value] : *node.as_table()) {
              const auto figure = value.value<double>();
              if (!figure || !(*figure > 0)) {
                return fmt::format("{} must be a positive number", key.str());
              }
              bool known = false;
              for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
                const std::string_view full = sensor_parameters[i].name;
                if (full == key.str() || full.substr(0, full.rfind('_')) == key.str()) {
                  (ins.*member)[i] = *figure;
                  known = true;
                }
              }
              if (!known) {
                return fmt::format("{} is no parameter and no group of parameters", key.str());
              }
            }
            return {};
          }};
}

constexpr double big = std::numeric_limits<double>::max();

const std::vector<Key<Config>>& daemon_keys() {
  static const std::vector<Key<Config>> keys{
      text("state_directory", &Config::state_directory),
      text("bus", &Config::bus),
      text("lcm_url", &Config::lcm_url, true),
      number("recordings_quota_mib", &Config::recordings_quota_mib, 1.0, big),
      number("recordings_keep_days", &Config::recordings_keep_days, 0.0, big),
      number("free_space_mib", &Config::free_space_mib, 1.0, big),
  };
  return keys;
}

const std::vector<Key<InsConfig>>& ins_keys() {
  static const std::vector<Key<InsConfig>> keys{
      text("interface", &InsConfig::interface),
      text("profile", &InsConfig::profile_name),
      can_id("request_id", &InsConfig::request_id),
      can_id("response_id", &InsConfig::response_id),
      can_id("functional_id", &InsConfig::functional_id),
      can_id("status_id", &InsConfig::status_id),
      flag("extended_ids", &InsConfig::extended_ids),
      flag("fd", &InsConfig::fd),
      text("key_file", &InsConfig::key_file),
      text("schedule", &InsConfig::schedule),
      number("dwell_s", &InsConfig::dwell_s, 1.0, 3600.0),
      number("rotation_s", &InsConfig::rotation_s, 1.0, 600.0),
      number("request_timeout_s", &InsConfig::request_timeout_s, 0.01, 60.0),
      number("lost_after_s", &InsConfig::lost_after_s, 0.1, 3600.0),
      number("running_estimate_s", &InsConfig::running_estimate_s, 0.0, 3600.0),
      number("drift_check_s", &InsConfig::drift_check_s, 0.0, 7200.0),
      number("time_scale", &InsConfig::time_scale, 0.1, 10000.0),
      number("latitude_deg", &InsConfig::latitude_deg, -90.0, 90.0),
      number("longitude_deg", &InsConfig::longitude_deg, -180.0, 180.0),
      number("height_m", &InsConfig::height_m, -1000.0, 20000.0),
      parameter_figures("tolerance", &InsConfig::tolerance),
      parameter_figures("limit", &InsConfig::limit),
  };
  return keys;
}

const std::vector<Key<HubConfig>>& hub_keys() {
  static const std::vector<Key<HubConfig>> keys{
      text("connection", &HubConfig::connection),
      text("recordings", &HubConfig::recordings, true),
      number("interval_s", &HubConfig::interval_s, 0.05, 3600.0),
  };
  return keys;
}

class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  template <typename Target>
  void read(const toml::table& table, const std::string& section, const std::vector<Key<Target>>& keys,
            Target& target) {
    for (const auto& [key, node] : table) {
      const std::string full = section + "." + std::string(key.str());
      const Key<Target>* known = nullptr;
      for (const auto& candidate : keys) {
        if (candidate.name == key.str()) {
          known = &candidate;
        }
      }
      if (known == nullptr) {
        std::vector<std::string_view> names;
        names.reserve(std::size(keys));
        for (const auto& candidate : keys) {
          names.push_back(candidate.name);
        }
        complain(key.source().begin.line, full,
                 "unknown key" + did_you_mean(key.str(), std::span<const std::string_view>(names)));
      } else if (const std::string complaint = known->set(node, target); !complaint.empty()) {
        complain(key.source().begin.line, full, complaint);
      }
    }
  }

  void complain(toml::source_index line, const std::string& key, const std::string& what) {
    if (!complaints_.empty()) {
      complaints_ += '\n';
    }
    complaints_ += fmt::format("{}:{}: {}: {}", file_, line, one_line(key), one_line(what));
  }

  const std::string& complaints() const { return complaints_; }

 private:
  std::string file_;
  std::string complaints_;
};

void read_hub(toml::source_index line, const toml::table& table, HubConfig& hub, Reader& reader) {
  reader.read(table, "hub", hub_keys(), hub);
  if (hub.connection.empty() && !table.contains("connection")) {
    reader.complain(line, "hub.connection", "missing");
  }
}

// "selfcal" is built in; a path is one from the configuration's folder, a mere name is a file of its folder profiles.
profile::ProfilePtr profile_of(const toml::table& table, const std::string& section, const std::string& file,
                               Reader& reader) {
  const toml::node* node = table.get("profile");
  if (node == nullptr) {
    return profile::built_in();
  }
  const auto line = node->source().begin.line;
  const auto name = node->value_exact<std::string>();
  if (!name || name->empty()) {
    reader.complain(line, section + ".profile", "must be a string that is not empty");
    return profile::built_in();
  }
  if (*name == profile::built_in()->name) {
    return profile::built_in();
  }
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  const bool is_path = name->find('/') != std::string::npos || name->ends_with(".toml");
  auto loaded = profile::load_profile((is_path ? folder / *name : folder / "profiles" / (*name + ".toml")).string());
  if (loaded) {
    return *loaded;
  }
  const std::string& faults = loaded.error().message;
  const auto more = std::ranges::count(faults, '\n');
  reader.complain(line, section + ".profile",
                  faults.substr(0, faults.find('\n')) +
                      (more > 0 ? fmt::format(" (and {} more: selfcal device lint)", more) : std::string()));
  return profile::built_in();
}

// What no single key shows: missing ones, and sections that contradict each other.
void check_instruments(const toml::table& sections, Config& config, Reader& reader) {
  for (InsConfig& ins : config.instruments) {
    const toml::table& table = *sections.get_as<toml::table>(ins.name);
    const auto line = table.source().begin.line;
    const std::string section = "ins." + ins.name;
    if (ins.interface.empty()) {
      reader.complain(line, section + ".interface", "missing");
    }
    ins.site_given = table.contains("latitude_deg");
    if (table.contains("longitude_deg") != ins.site_given || table.contains("height_m") != ins.site_given) {
      reader.complain(line, section, "latitude_deg, longitude_deg and height_m belong together");
    }
    if (!ins.profile->site.did && !ins.site_given) {
      reader.complain(line, section + ".latitude_deg", "missing, and the profile has no record site");
    }
    if (!ins.profile->navigation_check.id) {
      if (table.contains("drift_check_s") && ins.drift_check_s > 0) {
        reader.complain(line, section + ".drift_check_s", "the profile has no navigation check: 0 is the only value");
      }
      ins.drift_check_s = 0.0;
    }
    const std::uint32_t highest = ins.extended_ids ? 0x1FFFFFFFu : 0x7FFu;
    for (const auto& [key, id] :
         {std::pair{"request_id", ins.request_id}, std::pair{"response_id", ins.response_id},
          std::pair{"functional_id", ins.functional_id}, std::pair{"status_id", ins.status_id.value_or(0)}}) {
      if (id > highest) {
        reader.complain(line, section + "." + key, fmt::format("{:#x} needs extended_ids = true", id));
      }
    }
    for (const InsConfig& other : config.instruments) {
      if (&other == &ins) {
        break;
      }
      if (other.interface == ins.interface && other.request_id == ins.request_id) {
        reader.complain(line, section, fmt::format("same interface and request_id as ins.{}", other.name));
      }
    }
  }
}

}  // namespace

const InsConfig* Config::find(std::string_view name) const {
  for (const InsConfig& ins : instruments) {
    if (ins.name == name) {
      return &ins;
    }
  }
  return nullptr;
}

Expected<Config> parse_config(std::string_view content, const std::string& file) {
  const Expected<toml::table> root = parse_toml(content, file);
  if (!root) {
    return tl::unexpected(root.error());
  }

  Config config;
  Reader reader(file);
  for (const auto& [key, node] : *root) {
    const std::string section(key.str());
    if (section == "daemon" && node.is_table()) {
      reader.read(*node.as_table(), section, daemon_keys(), config);
    } else if (section == "hub" && node.is_table()) {
      HubConfig hub;
      read_hub(key.source().begin.line, *node.as_table(), hub, reader);
    } else if (section == "ins" && node.is_table()) {
      for (const auto& [name, ins_node] : *node.as_table()) {
        const std::string full = "ins." + std::string(name.str());
        if (!ins_node.is_table()) {
          reader.complain(name.source().begin.line, full, "must be a section [ins.NAME]");
          continue;
        }
        InsConfig ins(profile_of(*ins_node.as_table(), full, file, reader));
        ins.name = name.str();
        if (ins.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos) {
          reader.complain(name.source().begin.line, full, "a name holds a-z, 0-9 and _ only");
        }
        reader.read(*ins_node.as_table(), full, ins_keys(), ins);
        config.instruments.push_back(std::move(ins));
      }
    } else {
      reader.complain(key.source().begin.line, section, "unknown section");
    }
  }
  if (config.instruments.empty()) {
    reader.complain(1, "ins", "no INS is configured: at least one section [ins.NAME] is needed");
  } else {
    check_instruments(*root->get_as<toml::table>("ins"), config, reader);
  }
  if (!reader.complaints().empty()) {
    return fail(ErrorKind::bad_input, reader.complaints());
  }
  return config;
}

namespace {

Expected<std::string> text_of(const std::string& file) {
  std::ifstream in(file);
  if (!in) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot be opened", file));
  }
  std::stringstream content;
  content << in.rdbuf();
  return content.str();
}

}  // namespace

Expected<Config> load_config(const std::string& file) {
  const auto content = text_of(file);
  return content ? parse_config(*content, file) : tl::unexpected(content.error());
}

Expected<std::optional<HubConfig>> load_hub_config(const std::string& file) {
  const auto content = text_of(file);
  if (!content) {
    return tl::unexpected(content.error());
  }
  const auto root = parse_toml(*content, file);
  if (!root) {
    return tl::unexpected(root.error());
  }
  const toml::table* table = root->get_as<toml::table>("hub");
  if (table == nullptr) {
    return std::optional<HubConfig>();
  }
  HubConfig hub;
  Reader reader(file);
  read_hub(table->source().begin.line, *table, hub, reader);
  if (!reader.complaints().empty()) {
    return fail(ErrorKind::bad_input, reader.complaints());
  }
  return std::optional<HubConfig>(hub);
}

std::vector<std::string> config_keys() {
  std::vector<std::string> keys;
  for (const auto& key : daemon_keys()) {
    keys.push_back("daemon." + std::string(key.name));
  }
  for (const auto& key : hub_keys()) {
    keys.push_back("hub." + std::string(key.name));
  }
  for (const auto& key : ins_keys()) {
    keys.push_back("ins.*." + std::string(key.name));
  }
  return keys;
}

}  // namespace selfcal
