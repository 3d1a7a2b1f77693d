// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "frontend_fixture.h"
#include "tcp_peer.h"

namespace planar_mapping {
namespace {

TEST_F(FrontendTest, TheMapOfImagesIsThatOfOneProcessByteForByte) {
  const std::string input = simulatedImages(4);
  ASSERT_EQ(0, planarMap(runArguments("stereo_indoor.yaml", "one", {"-i", input})).exit_code);
  Mapper mapper(*this, runArguments("stereo_indoor.yaml", "two", {"--listen", "0"}));
  const ProgramResult sent = frontEnd(mapper.port(), {"-i", input});
  const ProgramResult mapped = mapper.wait();
  EXPECT_EQ(0, sent.exit_code) << sent.err;
  EXPECT_EQ(0, mapped.exit_code) << mapped.err;
  expectSameMap("one", "two");
}

TEST_F(FrontendTest, TheMapOfImagesWithoutPosesIsThatOfOneProcessByteForByte) {
  const std::string input = simulatedImages(4);
  std::filesystem::remove(input + "/poses.txt");
  ASSERT_EQ(0, planarMap(runArguments("stereo_indoor.yaml", "one", {"-i", input})).exit_code);
  Mapper mapper(*this, runArguments("stereo_indoor.yaml", "two", {"--listen", "0"}));
  EXPECT_EQ(0, frontEnd(mapper.port(), {"-i", input, "--encoding", "raw"}).exit_code);
  EXPECT_EQ(0, mapper.wait().exit_code);
  expectSameMap("one", "two");
}

TEST_F(FrontendTest, TheMapOfCloudsIsThatOfOneProcessByteForByte) {
  const std::vector<std::string> input = clouds(6);
  ASSERT_EQ(0, planarMap(runArguments("pcd_sequence.yaml", "one", input)).exit_code);
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "two", {"--listen", "127.0.0.1:0"}));
  expectExit(0, frontEnd(mapper.port(), input));
  expectExit(0, mapper.wait());
  expectSameMap("one", "two");
  EXPECT_NE(std::string::npos, read("two/run.log").find("input front-end at 127.0.0.1:"));
}

TEST_F(FrontendTest, AKilledFrontEndIsStartedAgainAndTheMapIsTheSame) {
  const std::vector<std::string> input = clouds(16);
  ASSERT_EQ(0, planarMap(runArguments("pcd_sequence.yaml", "one", input)).exit_code);
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "two", {"--listen", "0"}));
  frontEnd(mapper.port(), input, killAfter(mapper, 2, SIGKILL));
  expectExit(0, frontEnd(mapper.port(), input));
  const ProgramResult mapped = expectExit(0, mapper.wait());
  EXPECT_NE(std::string::npos, mapped.err.find("lost the connection to the front-end"));
  EXPECT_NE(std::string::npos, mapped.err.find("a front-end is back after frame"));
  expectSameMap("one", "two");
}

TEST_F(FrontendTest, AFrontEndThatVanishesLeavesAMapThatCanBeResumed) {
  const std::vector<std::string> input = clouds(16);
  ASSERT_EQ(0, planarMap(runArguments("pcd_sequence.yaml", "one", input)).exit_code);
  {
    Mapper mapper(*this,
                  runArguments("pcd_sequence.yaml", "two", {"--listen", "0", "--timeout", "2.5"}));
    frontEnd(mapper.port(), input, killAfter(mapper, 2, SIGKILL));
    const ProgramResult mapped = expectExit(4, mapper.wait());
    EXPECT_NE(std::string::npos, mapped.err.find("the front-end went away after frame "));
    EXPECT_NE(std::string::npos, mapped.err.find("; the map made so far is in "));
    EXPECT_EQ(0, planarMap({"info", directory_ / "two/map.pmap"}).exit_code);
  }
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "two", {"--listen", "0", "--resume"}));
  EXPECT_EQ(0, frontEnd(mapper.port(), input).exit_code);
  expectExit(0, mapper.wait());
  expectSameMap("one", "two");
}

TEST_F(FrontendTest, AKilledMapperIsStartedAgainAndTheFrontEndBeginsAgain) {
  const std::vector<std::string> input = clouds(16);
  ASSERT_EQ(0, planarMap(runArguments("pcd_sequence.yaml", "one", input)).exit_code);
  auto first =
      std::make_unique<Mapper>(*this, runArguments("pcd_sequence.yaml", "two", {"--listen", "0"}));
  const std::string port = first->port();
  auto sender = std::async(std::launch::async, [&]() { return frontEnd(port, input); });
  first->waitForFrames(2);
  first->signal(SIGKILL);
  first.reset();
  Mapper second(*this, runArguments("pcd_sequence.yaml", "two", {"--listen", port, "--force"}));
  EXPECT_EQ(0, second.wait().exit_code);
  const ProgramResult sent = expectExit(0, sender.get());
  EXPECT_NE(std::string::npos, sent.err.find("was restarted: beginning again"));
  expectSameMap("one", "two");
}

TEST_F(FrontendTest, ASecondFrontEndIsRefused) {
  const std::vector<std::string> input = clouds(16);
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "out", {"--listen", "0"}));
  // The first one is held in the middle while the second one tries.
  std::atomic<bool> is_held{false};
  std::atomic<bool> may_go_on{false};
  ProgramOptions options;
  options.while_running = [&](pid_t process, const std::string&) {
    if (!is_held && mapper.hasFrames(2)) {
      ::kill(process, SIGSTOP);
      is_held = true;
    }
    // Once only: the signal would disturb the leak check at the end of a sanitized program.
    if (may_go_on.exchange(false)) ::kill(process, SIGCONT);
  };
  auto first =
      std::async(std::launch::async, [&]() { return frontEnd(mapper.port(), input, options); });
  waitUntil([&is_held]() { return is_held.load(); });
  const ProgramResult second = frontEnd(mapper.port(), input);
  may_go_on = true;
  EXPECT_EQ(4, second.exit_code);
  expectOneSentence(second, "the mapping side is serving another front-end already");
  EXPECT_EQ(0, first.get().exit_code);
  EXPECT_EQ(0, mapper.wait().exit_code);
}

TEST_F(FrontendTest, AnInterruptedFrontEndEndsBothSidesCleanly) {
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "out", {"--listen", "0"}));
  const ProgramResult sent =
      expectExit(130, frontEnd(mapper.port(), clouds(16), killAfter(mapper, 2, SIGINT)));
  EXPECT_EQ(0u, sent.err.find("planar_map: stopping: the frame in work is finished")) << sent.err;
  EXPECT_NE(std::string::npos, sent.err.find("planar_map: interrupted after")) << sent.err;
  const ProgramResult mapped = expectExit(4, mapper.wait());
  EXPECT_NE(std::string::npos, mapped.err.find("the front-end was interrupted after frame"));
  EXPECT_TRUE(exists("out/map.pmap"));
}

TEST_F(FrontendTest, AMapperThatIsBehindOutlivesAnInterruptedFrontEnd) {
  Mapper mapper(*this,
                runArguments("pcd_sequence.yaml", "out", {"--listen", "0", "--timeout", "2"}));
  ProgramOptions options;
  bool sent = false;
  options.while_running = [&](pid_t process, const std::string&) {
    if (sent || !mapper.hasFrames(2)) return;
    sent = true;
    mapper.signal(SIGSTOP);
    ::kill(process, SIGINT);
  };
  expectExit(130, frontEnd(mapper.port(), clouds(30), options));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  mapper.signal(SIGCONT);
  expectExit(4, mapper.wait());
  EXPECT_EQ(0, planarMap({"info", directory_ / "out/map.pmap"}).exit_code);
}

TEST_F(FrontendTest, AnInterruptedMapperSavesAndTellsTheFrontEnd) {
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "out", {"--listen", "0"}));
  auto sender =
      std::async(std::launch::async, [&]() { return frontEnd(mapper.port(), clouds(30)); });
  mapper.waitForFrames(2);
  mapper.signal(SIGINT);
  EXPECT_EQ(130, mapper.wait().exit_code);
  EXPECT_TRUE(exists("out/map.pmap"));
  expectExit(4, sender.get(), "ended the session: the mapping side was interrupted");
}

TEST_F(FrontendTest, MemoryDoesNotGrowWithTheSequence) {
  const auto peaks = [this](int frames) {
    Mapper mapper(*this, runArguments("pcd_sequence.yaml", "out", {"--listen", "0", "--force"}));
    const ProgramResult sent = expectExit(0, frontEnd(mapper.port(), clouds(frames)));
    return std::make_pair(sent.peak_kilobytes, mapper.wait().peak_kilobytes);
  };
  const auto few = peaks(8);
  const auto many = peaks(48);
  // A frame is 320 kB in memory; the mapper is the slower of the two.
#ifndef PLANAR_MAPPING_SANITIZED  // sanitizers keep freed memory
  EXPECT_LT(many.first, few.first + 3000);
  EXPECT_LT(many.second, few.second + 6000);
#endif
}

TEST_F(FrontendTest, IdleConnectionsOfStrangersDoNotCostTheMap) {
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "out", {"--listen", "0"}));
  const std::string port = mapper.port();
  mapper.limit(RLIMIT_NOFILE, 120);
  std::atomic<bool> is_over{false};
  auto strangers = std::async(std::launch::async, [&]() {
    mapper.waitForFrames(2);
    std::vector<TcpPeer> idle;
    for (int i = 0; i < 300 && !is_over; ++i) {
      try {
        idle.push_back(TcpPeer::to(static_cast<std::uint16_t>(std::stoi(port)), 0.2));
      } catch (const std::runtime_error&) {  // the mapper takes no more
      }
    }
    while (!is_over) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  });
  const ProgramResult sent = frontEnd(port, clouds(16));
  const ProgramResult mapped = mapper.wait();
  is_over = true;
  expectExit(0, sent);
  expectExit(0, mapped);
  EXPECT_EQ(0, planarMap({"info", directory_ / "out/map.pmap"}).exit_code);
}

TEST_F(FrontendTest, AFailedSaveEndsBothSidesWithCode4) {
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "out", {"--listen", "0"}));
  const std::string port = mapper.port();
  mapper.limit(RLIMIT_FSIZE, 100);
  expectExit(4, frontEnd(port, clouds(3)), "the mapping side could not save the map");
  const ProgramResult mapped = expectExit(4, mapper.wait());
  EXPECT_NE(std::string::npos, mapped.err.find("File too large")) << mapped.err;
  EXPECT_FALSE(exists("out/map.pmap"));
}

TEST_F(FrontendTest, AnInterruptedWaitEndsAtOnce) {
  for (const char* configuration : {"pcd_sequence.yaml", "stereo_indoor.yaml"}) {
    Mapper mapper(*this, runArguments(configuration, configuration, {"--listen", "0"}));
    (void)mapper.port();
    mapper.signal(SIGINT);
    const ProgramResult mapped = expectExit(130, mapper.wait());
    EXPECT_LT(mapped.seconds, 10.0);
  }
}

TEST_F(FrontendTest, WrongAddressesAreNamed) {
  const std::string cloud = room();
  ProgramResult result = frontEnd("1", {"-i", cloud, "--timeout", "0.3"});
  EXPECT_EQ(4, result.exit_code);
  expectOneSentence(result, "the mapping side at 127.0.0.1:1 cannot be reached within 0.3 s");
  result = frontEnd("no-such-host.invalid:5000", {"-i", cloud, "--timeout", "0.3"});
  EXPECT_EQ(4, result.exit_code);
  expectOneSentence(result, "the host name 'no-such-host.invalid' cannot be resolved");
  result = frontEnd("localhost:0", {"-i", cloud});
  EXPECT_EQ(2, result.exit_code);
  expectOneSentence(result, "port 0 is to listen only");
  result = frontEnd("http://localhost", {"-i", cloud});
  EXPECT_EQ(2, result.exit_code);
  expectOneSentence(result, "is not HOST:PORT");
  result = planarMap(runArguments("pcd_sequence.yaml", "out", {"--listen", "70000"}));
  EXPECT_EQ(2, result.exit_code);
  expectOneSentence(result, "--listen: '70000' is not HOST:PORT");
  result = planarMap(runArguments("pcd_sequence.yaml", "out", {"--listen", "0", "-i", cloud}));
  EXPECT_EQ(2, result.exit_code);
}

TEST_F(FrontendTest, AMissingInputIsToldToBothSidesAndTheMapperWaitsForTheRightOne) {
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "out", {"--listen", "0"}));
  expectExit(4, frontEnd(mapper.port(), {"-i", directory_ / "nothing"}), "nothing");
  EXPECT_EQ(0, frontEnd(mapper.port(), clouds(2)).exit_code);
  const ProgramResult mapped = expectExit(0, mapper.wait());
  EXPECT_NE(std::string::npos, mapped.err.find("a front-end gave up before its first frame: "));
}

TEST_F(FrontendTest, OnlyFrontEndsWithAKnownKeyGetThrough) {
  const std::vector<std::string> input = clouds(4);
  const auto with = [&input](const std::string& keys) {
    return joined(input, {"--keys", keys, "--timeout", "3"});
  };
  ASSERT_EQ(0, planarMap(runArguments("pcd_sequence.yaml", "one", input)).exit_code);
  for (const char* name : {"frontend", "robot2"})
    EXPECT_EQ(0, planarMap({"keys", "-o", directory_ / "keys", "--name", name}).exit_code);
  EXPECT_EQ(0, planarMap({"keys", "-o", directory_ / "others"}).exit_code);
  expectExit(2, planarMap({"keys", "-o", directory_ / "keys"}),
             "frontend.key' exists; --force overwrites it");
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "two",
                                    {"--listen", "0", "--keys", directory_ / "keys/mapper.key"}));
  expectExit(4, frontEnd(mapper.port(), with(directory_ / "others/frontend.key")));
  expectExit(4, frontEnd(mapper.port(), joined(clouds(1), {"--timeout", "3"})));  // without a key
  expectExit(0, frontEnd(mapper.port(), with(directory_ / "keys/robot2.key")));
  EXPECT_EQ(0, mapper.wait().exit_code);
  expectSameMap("one", "two");
}

TEST_F(FrontendTest, KeyFilesOfOthersAndOpenOnesAreRefused) {
  EXPECT_EQ(0, planarMap({"keys", "-o", directory_ / "keys"}).exit_code);
  std::filesystem::permissions(directory_ / "keys/mapper.key", std::filesystem::perms::group_read,
                               std::filesystem::perm_options::add);
  const auto listen = [this](const std::string& keys) {
    return planarMap(runArguments("pcd_sequence.yaml", "out", {"--listen", "0", "--keys", keys}));
  };
  expectOneSentence(listen(directory_ / "keys/mapper.key"), "others can read this key");
  expectOneSentence(listen(directory_ / "keys/nothing.key"), "cannot be read");
  std::ofstream(directory_ / "keys/frontend.key") << "secret x";
  expectOneSentence(listen(directory_ / "keys/frontend.key"), "this is no key file");
}

TEST_F(FrontendTest, ListeningToOtherMachinesNeedsKeysOrInsecure) {
  expectExit(2, planarMap(runArguments("pcd_sequence.yaml", "out", {"--listen", "0.0.0.0:0"})),
             "take the risk with --insecure");
  const ProgramResult allowed = expectExit(
      4, planarMap(runArguments("pcd_sequence.yaml", "out",
                                {"--listen", "0.0.0.0:0", "--insecure", "--timeout", "0.1"})));
  EXPECT_EQ(0U, allowed.err.find("planar_map: warning: without --keys whoever reaches"));
}

TEST_F(FrontendTest, AMapperThatHangsIsGivenUp) {
  Mapper mapper(*this, runArguments("pcd_sequence.yaml", "out", {"--listen", "0"}));
  auto sender = std::async(std::launch::async, [&]() {
    return frontEnd(mapper.port(), joined(clouds(30), {"--timeout", "1"}));
  });
  mapper.waitForFrames(2);
  mapper.signal(SIGSTOP);
  const ProgramResult sent = expectExit(4, sender.get());
  EXPECT_NE(std::string::npos, sent.err.find("lost the connection")) << sent.err;
  EXPECT_LT(sent.seconds, 20.0);
}

}  // namespace
}  // namespace planar_mapping
