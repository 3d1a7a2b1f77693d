// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/front_end_source.h"
#include "planar_mapping/transport/endpoint.h"
#include "planar_mapping/transport/message.h"
#include "temporary_directory.h"
#include "transport_session.h"

namespace planar_mapping::transport {
namespace {

TEST(Endpoint, ReadsHostAndPort) {
  const Endpoint named = parseEndpoint("robot.local:5555");
  EXPECT_EQ("robot.local", named.host);
  EXPECT_EQ(5555, named.port);
  const Endpoint ipv6 = parseEndpoint("[::1]:80");
  EXPECT_EQ("::1", ipv6.host);
  EXPECT_EQ(80, ipv6.port);
}

TEST(Endpoint, APortAloneStaysOnThisMachine) {
  const Endpoint endpoint = parseEndpoint("5555");
  EXPECT_EQ("127.0.0.1", endpoint.host);
  EXPECT_EQ(5555, endpoint.port);
}

TEST(Endpoint, TextComesBack) {
  for (const char* text : {"127.0.0.1:0", "[::1]:65535", "a-b.c:1", "ipc:///tmp/x"})
    EXPECT_EQ(text, toText(parseEndpoint(text)));
}

TEST(Endpoint, AnythingElseIsAnError) {
  for (const char* text :
       {"", ":", "host:", ":5555", "host:65536", "host:-1", "host:12x", "host", "::1:80", "[]:80",
        "[::1]", "a b:1", "tcp://host:1", "ipc://", "1.5", " 80"}) {
    EXPECT_THROW(parseEndpoint(text), InputError) << text;
  }
}

TEST(Endpoint, OnlyThisMachineIsLoopback) {
  for (const char* text : {"5555", "localhost:1", "127.8.9.1:1", "[::1]:1", "ipc:///tmp/x"})
    EXPECT_TRUE(isLoopback(parseEndpoint(text))) << text;
  for (const char* text : {"0.0.0.0:1", "[::]:1", "192.0.2.1:1"})
    EXPECT_FALSE(isLoopback(parseEndpoint(text))) << text;
}

TEST(Endpoint, AddressesResolveToThemselvesAndUnknownNamesDoNot) {
  EXPECT_EQ("127.0.0.1", resolved({"127.0.0.1", 1}).host);
  EXPECT_EQ("127.0.0.1", resolved({"localhost", 1}).host);
  try {
    resolved({"no-such-host.invalid", 1});
    FAIL() << "resolved";
  } catch (const InputError& error) {
    EXPECT_NE(std::string::npos,
              std::string(error.what()).find("'no-such-host.invalid' cannot be resolved"));
  }
}

class KeysTest : public ::testing::Test {
 protected:
  KeysTest() {
    mapper_.peers = {known_.public_key};
    known_.peers = {mapper_.public_key};
    ListenerOptions options = listenerOptions();
    options.keys = mapper_;
    options.say = [this](const std::string& text) { said_ += text + "\n"; };
    listener_ = std::make_unique<FrameListener>(Endpoint{"127.0.0.1", 0}, options);
  }
  std::future<FrontEndResult> sendWith(const Keys& keys, double timeout = 5.0) {
    FrontEndOptions options = frontEndOptions(timeout);
    options.keys = keys;
    return sendInBackground(listener_->endpoint(), {4}, options);
  }
  Keys mapper_ = makeKeys();
  Keys known_ = makeKeys();
  std::string said_;
  std::unique_ptr<FrameListener> listener_;
};

TEST_F(KeysTest, AnUnknownKeyIsRefusedAndBothSidesSaySo) {
  Keys stranger = makeKeys();
  stranger.peers = {mapper_.public_key};
  auto refused = sendWith(stranger);
  auto taken = std::async(std::launch::async, [this]() { return takeAll(*listener_); });
  EXPECT_NE(std::string::npos, errorOf([&]() { refused.get(); }).find("does not know our key"));
  EXPECT_EQ(4U, sendWith(known_).get().frames_sent);
  EXPECT_EQ(4U, taken.get());
  EXPECT_NE(std::string::npos, said_.find("its key is not among those of --keys"));
}

TEST_F(KeysTest, WhoHasNoKeyOrTakesUsForAnotherIsNotAdmitted) {
  auto without = sendWith(Keys(), 1.0);
  Keys misled = known_;
  misled.peers = {makeKeys().public_key};
  auto other = sendWith(misled, 1.0);
  auto taken = std::async(std::launch::async, [this]() { return takeAll(*listener_); });
  EXPECT_NE("nothing was thrown", errorOf([&]() { without.get(); }));
  EXPECT_NE("nothing was thrown", errorOf([&]() { other.get(); }));
  EXPECT_EQ(4U, sendWith(known_).get().frames_sent);
  EXPECT_EQ(4U, taken.get());
}

constexpr const char* kConfiguration =
    "version: 1\nseed: 7\nthreads: 2\ninputs:\n  - /secret/input\nposes: /secret/poses.txt\n"
    "frames: \"1:4:1\"\nstages:\n"
    "  - stage: multi_plane_segmentation\n  - stage: planar_cuboid_approximation\n";

std::string frontEndPart() {
  StageTable table;
  registerBuiltinStages(table);
  return frontEndYaml(parseConfiguration(kConfiguration, "test.yaml", table));
}

class FrontEndSourceTest : public ::testing::Test {
 protected:
  std::string cloud(const std::string& name, int points) const {
    const std::string path = directory_ / name;
    std::ofstream out(path);
    out << "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " << points
        << "\nHEIGHT 1\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS " << points << "\nDATA ascii\n";
    for (int i = 0; i < points; ++i) out << i << " 1 2\n";
    return path;
  }
  FrontEndInput input() const {
    FrontEndInput result;
    for (int i = 0; i < 5; ++i) result.inputs.push_back(cloud(std::to_string(i) + ".pcd", 3 + i));
    return result;
  }

  TemporaryDirectory directory_;
};

TEST_F(FrontEndSourceTest, TheConfigurationSentNamesNoFiles) {
  const std::string yaml = frontEndPart();
  EXPECT_EQ(std::string::npos, yaml.find("secret")) << yaml;
  EXPECT_EQ(std::string::npos, yaml.find("threads")) << yaml;
  EXPECT_NE(std::string::npos, yaml.find("seed: 7")) << yaml;
  EXPECT_NE(std::string::npos, yaml.find("frames: \"1:4:1\"")) << yaml;
  EXPECT_EQ(std::string::npos, yaml.find("planar_cuboid_approximation")) << yaml;
}

TEST_F(FrontEndSourceTest, GivesTheFramesTheMappingSideSelected) {
  const auto source = makeFrontEndSource(frontEndPart(), input());
  const InputDescription described = describe(*source);
  EXPECT_EQ(io::SequenceKind::Clouds, described.kind);
  EXPECT_EQ(io::PoseSource::Viewpoint, described.pose_source);
  EXPECT_EQ(3U, described.frames);
  for (std::size_t i = 1; i < 4; ++i) {
    const std::optional<Frame> frame = source->next();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(i, frame->number);
    EXPECT_EQ(3 + i, frame->cloud->size());
    EXPECT_TRUE(frame->front_end_done);
    EXPECT_EQ(Vector3(1, 2, 3), frame->T_world_sensor.translation());
  }
  EXPECT_FALSE(source->next().has_value());
}

TEST_F(FrontEndSourceTest, TheFingerprintTellsInputsApart) {
  const auto fingerprint = [this](const std::vector<std::string>& names) {
    FrontEndInput files;
    for (const std::string& name : names) files.inputs.push_back(cloud(name, 3));
    files.inputs.push_back(cloud("x.pcd", 3));
    files.inputs.push_back(cloud("y.pcd", 3));
    return describe(*makeFrontEndSource(frontEndPart(), files)).fingerprint;
  };
  EXPECT_EQ(fingerprint({"a.pcd"}), fingerprint({"a.pcd"}));
  EXPECT_NE(fingerprint({"a.pcd"}), fingerprint({"b.pcd"}));
  EXPECT_NE(fingerprint({"a.pcd", "b.pcd"}), fingerprint({"b.pcd", "a.pcd"}));
}

TEST_F(FrontEndSourceTest, WhatCouldHarmThisMachineIsNotTaken) {
  const FrontEndInput files = input();
  const auto refuses = [&files](const std::string& yaml, const std::string& part) {
    const std::string error = errorOf([&]() { makeFrontEndSource(yaml, files); });
    EXPECT_NE(std::string::npos, error.find(part)) << error;
    EXPECT_THROW(makeFrontEndSource(yaml, files), ConfigError);
  };
  const std::string good = frontEndPart();
  refuses(good + "plugins:\n  - /tmp/evil.so\n", "key 'plugins' is not taken from the network");
  refuses(good + "inputs: [/etc/shadow]\n", "key 'inputs' is not taken from the network");
  refuses("{version: 1, \"plugins\": [x.so], stages: []}", "key 'plugins'");
  refuses("", "this is no configuration");
  refuses("[1, 2]", "this is no configuration");
  refuses(",", "this is no configuration");
  refuses("a: [", "configuration of the mapping side:");
  refuses("version: 1\nstages:\n  - stage: no_such_stage\n", "no_such_stage");
}

}  // namespace
}  // namespace planar_mapping::transport
