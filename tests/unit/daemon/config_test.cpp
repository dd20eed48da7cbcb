#include "daemon/host/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "protocol/schedule_file/schedule_file.hpp"

namespace selfcal {
namespace {

using testing::HasSubstr;

std::string complaint(std::string_view text) {
  const auto config = parse_config(text, "f.toml");
  return config ? std::string() : config.error().message;
}

TEST(Config, TheShippedFileIsWellFormedAndHoldsTheDefaults) {
  const auto config = load_config(SELFCAL_SOURCE_DIR "/config/selfcald.toml");
  ASSERT_TRUE(config) << config.error().message;
  const InsConfig defaults;
  const InsConfig& shipped = config->instruments.at(0);
  EXPECT_EQ(defaults.schedule, default_schedule);  // that of the command line
  EXPECT_EQ(shipped.request_id, defaults.request_id);
  EXPECT_EQ(shipped.response_id, defaults.response_id);
  EXPECT_EQ(shipped.status_id, defaults.status_id);
  EXPECT_EQ(shipped.schedule, defaults.schedule);
  EXPECT_EQ(shipped.dwell_s, defaults.dwell_s);
  EXPECT_EQ(shipped.rotation_s, defaults.rotation_s);
  EXPECT_EQ(shipped.request_timeout_s, defaults.request_timeout_s);
  EXPECT_EQ(shipped.lost_after_s, defaults.lost_after_s);
  EXPECT_EQ(shipped.drift_check_s, defaults.drift_check_s);
  EXPECT_EQ(shipped.running_estimate_s, defaults.running_estimate_s);
  EXPECT_EQ(shipped.time_scale, defaults.time_scale);
  EXPECT_EQ(config->state_directory, Config().state_directory);
  EXPECT_EQ(config->bus, Config().bus);
  EXPECT_EQ(config->lcm_url, Config().lcm_url);
  EXPECT_EQ(config->recordings_quota_mib, Config().recordings_quota_mib);
  EXPECT_EQ(config->free_space_mib, Config().free_space_mib);
}

TEST(Config, TheShippedFileShowsEveryKey) {
  std::ifstream in(SELFCAL_SOURCE_DIR "/config/selfcald.toml");
  std::stringstream text;
  text << in.rdbuf();
  for (const std::string& key : config_keys()) {
    const std::string last = key.substr(key.rfind('.') + 1);
    EXPECT_THAT(text.str(), HasSubstr(last + " = ")) << key;
  }
}

TEST(Config, AHubNeedsAConnection) {
  const std::string ins = "[ins.a]\ninterface = \"c\"\n";
  EXPECT_TRUE(parse_config(ins + "[hub]\nconnection = \"host=h\"\n", "f.toml"));
  EXPECT_EQ(complaint(ins + "[hub]\ninterval_s = 3.0\n"), "f.toml:3: hub.connection: missing");
  EXPECT_EQ(complaint(ins + "[hub]\nconnection = \"\"\n"), "f.toml:4: hub.connection: must not be empty");
}

TEST(Config, AKeyComesBeforeTheProfileAndTheProfileBeforeTheDefault) {
  const std::string section =
      "[ins.a]\ninterface = \"c\"\nprofile = \"" SELFCAL_SOURCE_DIR "/config/profiles/example.toml\"\n";
  const auto plain = parse_config(section, "f.toml");
  ASSERT_TRUE(plain) << plain.error().message;
  const InsConfig& ins = plain->instruments.at(0);
  EXPECT_EQ(ins.profile->name, "example");
  EXPECT_EQ(ins.request_id, 0x18DA2AF1U);
  EXPECT_TRUE(ins.extended_ids);
  EXPECT_EQ(ins.request_timeout_s, 1.5);
  EXPECT_EQ(ins.status_id, std::nullopt);
  const auto own = parse_config(section + "request_id = 0x18DA2BF1\nrequest_timeout_s = 3.0\n", "f.toml");
  ASSERT_TRUE(own) << own.error().message;
  EXPECT_EQ(own->instruments.at(0).request_id, 0x18DA2BF1U);
  EXPECT_EQ(own->instruments.at(0).response_id, 0x18DAF12AU);
  EXPECT_EQ(own->instruments.at(0).request_timeout_s, 3.0);
  EXPECT_EQ(InsConfig().request_id, profile::built_in()->bus.request);
}

TEST(Config, AProfileThatCannotBeReadIsNamedWithTheKeysLine) {
  EXPECT_EQ(complaint("[ins.a]\ninterface = \"c\"\nprofile = \"nowhere\"\n"),
            "f.toml:3: ins.a.profile: profiles/nowhere.toml: cannot be opened");
}

TEST(Config, UnknownKeyIsNamedWithItsLine) {
  EXPECT_EQ(complaint("[ins.a]\ninterface = \"vcan0\"\ntypo = 1\n"), "f.toml:3: ins.a.typo: unknown key");
  EXPECT_EQ(complaint("[ins.a]\ninterface = \"vcan0\"\n[deamon]\n"), "f.toml:3: deamon: unknown section");
}

TEST(Config, EveryComplaintIsShown) {
  const std::string text = complaint("[ins.a]\ninterface = 3\ndwell_s = -1\n");
  EXPECT_THAT(text, HasSubstr("f.toml:2: ins.a.interface: must be a string"));
  EXPECT_THAT(text, HasSubstr("f.toml:3: ins.a.dwell_s: is -1, must lie between 1 and 3600"));
}

TEST(Config, WhatContradictsItselfIsRefused) {
  EXPECT_THAT(complaint(""), HasSubstr("at least one section"));
  EXPECT_THAT(complaint("[ins.a]\nfd = true\n"), HasSubstr("ins.a.interface: missing"));
  EXPECT_THAT(complaint("[ins.a]\ninterface = \"c\"\nrequest_id = 0x800\n"), HasSubstr("needs extended_ids"));
  EXPECT_THAT(complaint("[ins.a]\ninterface = \"c\"\n[ins.b]\ninterface = \"c\"\n"),
              HasSubstr("same interface and request_id as ins.a"));
  EXPECT_THAT(complaint("[ins.a]\ninterface = \"c\"\nlatitude_deg = 40\n"), HasSubstr("belong together"));
  EXPECT_THAT(complaint("[ins.A]\ninterface = \"c\"\n"), HasSubstr("a name holds"));
  EXPECT_THAT(complaint("[ins.a]\ninterface = \"c\"\ndwell_s = nan\n"), HasSubstr("must lie between"));
  EXPECT_THAT(complaint("[ins.a\n"), HasSubstr("f.toml:1:"));
}

// Texts that toml++ by itself does not survive, and keys that would make two lines of one complaint.
TEST(Config, HostileTextIsOneComplaint) {
  EXPECT_THAT(complaint("[ins.a]\nt = 6='\u00C5\n"), HasSubstr("f.toml:2: "));
  EXPECT_THAT(complaint("[ins.a]\ninterface = '\xFF'\n"), HasSubstr("f.toml:2: byte 0xFF"));
  EXPECT_THAT(complaint("[a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a]\n"), HasSubstr("f.toml:1: a key of more than"));
  EXPECT_EQ(complaint("[ins.a]\ninterface = 'c'\n\"ty\\npo\" = 1\n"), "f.toml:3: ins.a.ty po: unknown key");
}

TEST(Config, NamesInAnyScriptAreKept) {
  const auto config =
      parse_config("[daemon]\nstate_directory = '/var/lib/\u6E2C\u91CF'\n[ins.a]\ninterface = 'c'\n", "f");
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_EQ(config->state_directory, "/var/lib/\u6E2C\u91CF");
}

TEST(Config, TolerancesTakeParametersAndGroups) {
  const auto config =
      parse_config("[ins.a]\ninterface = \"c\"\ntolerance = { gyro_scale = 3, accel_bias_y = 2.5 }\n", "f.toml");
  ASSERT_TRUE(config) << config.error().message;
  const auto& tolerance = config->instruments.at(0).tolerance;
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(tolerance[static_cast<std::size_t>(parameter::gyro_scale + axis)], 3.0);
  }
  EXPECT_EQ(tolerance[parameter::accel_bias + 1], 2.5);
  EXPECT_FALSE(tolerance[parameter::accel_bias]);
  EXPECT_THAT(complaint("[ins.a]\ninterface = \"c\"\nlimit = { gyro_scal = 3 }\n"),
              HasSubstr("gyro_scal is no parameter"));
}

}  // namespace
}  // namespace selfcal
