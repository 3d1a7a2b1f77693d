// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

#include "cli_fixture.h"

namespace planar_mapping {

/// Two programs that talk to each other: `run --listen` and `frontend`.
class FrontendTest : public CliTest {
 protected:
  template <typename Condition>
  static void waitUntil(const Condition& condition) {
    const auto start = std::chrono::steady_clock::now();
    while (!condition()) {
      if (std::chrono::steady_clock::now() - start > std::chrono::seconds(30)) {
        throw std::runtime_error("what was waited for did not happen");
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  /// `run --listen` in the background. Its port is chosen by the system.
  class Mapper {
   public:
    Mapper(const FrontendTest& test, std::vector<std::string> arguments) {
      ProgramOptions options;
      options.while_running = [this](pid_t process, const std::string& err) {
        const std::lock_guard<std::mutex> lock(mutex_);
        process_ = process;
        err_ = err;
      };
      result_ = std::async(std::launch::async, [&test, arguments, options]() {
        return test.planarMap(arguments, options);
      });
    }
    ~Mapper() {
      if (result_.valid()) {
        signal(SIGKILL);
        result_.wait();
      }
    }

    /// Waits until it listens.
    std::string port() const {
      const std::string before = "listening on 127.0.0.1:";
      std::string port;
      waitUntil([&]() {
        const std::string text = err();
        const std::size_t at = text.find(before);
        const std::size_t end = text.find('\n', at);
        if (at == std::string::npos || end == std::string::npos) return false;
        port = text.substr(at + before.size(), end - at - before.size());
        return true;
      });
      return port;
    }
    bool hasFrames(int count) const {
      return err().find("\"done\":" + std::to_string(count)) != std::string::npos;
    }
    void waitForFrames(int count) const {
      waitUntil([this, count]() { return hasFrames(count); });
    }
    void signal(int number) const {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (process_ > 0) ::kill(process_, number);
    }
    /// Limits a resource of the process, of the system (RLIMIT_...).
    void limit(__rlimit_resource resource, rlim_t value) const {
      const std::lock_guard<std::mutex> lock(mutex_);
      const rlimit limits = {value, value};
      ASSERT_EQ(0, ::prlimit(process_, resource, &limits, nullptr));
    }
    ProgramResult wait() { return result_.get(); }

   private:
    std::string err() const {
      const std::lock_guard<std::mutex> lock(mutex_);
      return err_;
    }
    mutable std::mutex mutex_;
    std::string err_;
    pid_t process_ = 0;
    std::future<ProgramResult> result_;
  };

  std::vector<std::string> runArguments(const std::string& configuration, const std::string& output,
                                        const std::vector<std::string>& more) const {
    return joined(
        {"run", config(configuration), "-o", directory_ / output, "-q", "--progress", "jsonl"},
        more);
  }
  ProgramResult frontEnd(const std::string& endpoint, const std::vector<std::string>& more,
                         const ProgramOptions& options = {}) const {
    return planarMap(joined({"frontend", "--connect", endpoint}, more), options);
  }
  /// Sends the front-end a signal once the mapper has mapped some frames. The front-end is at most
  /// three frames ahead, so that a longer sequence is never done by then.
  static ProgramOptions killAfter(const Mapper& mapper, int frames, int number) {
    ProgramOptions options;
    const auto sent = std::make_shared<bool>(false);  // a second SIGINT would not be clean
    options.while_running = [&mapper, frames, number, sent](pid_t process, const std::string&) {
      if (*sent || !mapper.hasFrames(frames)) return;
      *sent = true;
      ::kill(process, number);
    };
    return options;
  }
  /// -i arguments of clouds of a room, each with noise of its own.
  std::vector<std::string> clouds(int count) const {
    std::vector<std::string> arguments;
    for (int i = 0; i < count; ++i) {
      const std::string name = "clouds/" + std::to_string(100 + i) + ".pcd";
      arguments.insert(arguments.end(), {"-i", room(name, 1U + static_cast<unsigned>(i))});
    }
    return arguments;
  }
  std::string simulatedImages(int frames) const {
    const std::string output = directory_ / "images";
    const ProgramResult made = planarMap({"simulate", "room", "-o", output, "--write", "images",
                                          "--frames", std::to_string(frames), "--step", "0.1",
                                          "--width", "320", "--height", "240", "-q"});
    EXPECT_EQ(0, made.exit_code) << made.err;
    return output;
  }
  void expectSameMap(const std::string& one, const std::string& two) const {
    ASSERT_FALSE(read(one + "/map.pmap").empty());
    EXPECT_TRUE(read(one + "/map.pmap") == read(two + "/map.pmap"));
    EXPECT_TRUE(read(one + "/map.json") == read(two + "/map.json"));
    EXPECT_EQ(read(one + "/trajectory_tum.txt"), read(two + "/trajectory_tum.txt"));
  }
};

}  // namespace planar_mapping
