// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

namespace planar_mapping::testing {

/// An Xvfb of our own for as long as this lives; running() is false where there is none.
class XServer {
 public:
  explicit XServer(const std::vector<std::string>& extra = {}) {
    int ends[2];
    if (::pipe(ends) != 0) return;
    process_ = ::fork();
    if (process_ == 0) {
      ::close(ends[0]);
      const std::string descriptor = std::to_string(ends[1]);
      std::vector<std::string> words = {"Xvfb", "-displayfd", descriptor,  "-screen",
                                        "0",    "800x600x24", "-nolisten", "tcp"};
      words.insert(words.end(), extra.begin(), extra.end());
      std::vector<char*> argv;
      for (std::string& word : words) argv.push_back(word.data());
      argv.push_back(nullptr);
      ::freopen("/dev/null", "w", stderr);
      ::execvp("Xvfb", argv.data());
      ::_exit(127);
    }
    ::close(ends[1]);
    char c = '\0';
    while (::read(ends[0], &c, 1) == 1 && c != '\n') number_ += c;
    ::close(ends[0]);
  }
  ~XServer() {
    if (process_ <= 0) return;
    ::kill(process_, SIGTERM);
    ::waitpid(process_, nullptr, 0);
  }
  XServer(const XServer&) = delete;
  XServer& operator=(const XServer&) = delete;

  bool running() const { return !number_.empty(); }
  std::string display() const { return ":" + number_; }

 private:
  pid_t process_ = -1;
  std::string number_;
};

}  // namespace planar_mapping::testing
