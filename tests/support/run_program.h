// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace planar_mapping {

/// What became of a program that was started.
struct ProgramResult {
  int exit_code = -1;  ///< -1 if it was killed
  int signal = 0;      ///< that killed it
  bool timed_out = false;
  std::string out;
  std::string err;
  double seconds = 0.0;
  double processor_seconds = 0.0;  ///< of all its threads, the system's part included
  long peak_kilobytes = 0;         ///< of resident memory
};

struct ProgramOptions {
#ifdef PLANAR_MAPPING_SANITIZED
  double timeout_s = 600.0;
#else
  double timeout_s = 60.0;
#endif
  std::string directory;      ///< working directory; empty = that of the test
  long file_size_limit = -1;  ///< bytes a file may have (RLIMIT_FSIZE)
  /// Called with the process id while the program runs, about every millisecond.
  std::function<void(pid_t, const std::string& err)> while_running;
};

namespace detail {

inline void readAvailable(int descriptor, std::string& text) {
  char buffer[65536];
  for (;;) {
    const ssize_t count = ::read(descriptor, buffer, sizeof(buffer));
    if (count <= 0) return;
    text.append(buffer, static_cast<std::size_t>(count));
  }
}

}  // namespace detail

/// Starts a program and waits for its end; what it prints is captured, stdin is empty.
inline ProgramResult runProgram(const std::vector<std::string>& arguments,
                                const ProgramOptions& options = {}) {
  int out[2];
  int err[2];
  if (::pipe2(out, O_CLOEXEC) != 0 || ::pipe2(err, O_CLOEXEC) != 0) {
    throw std::runtime_error("no pipe");
  }
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [start]() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(err[1], STDERR_FILENO);
    if (!options.directory.empty() && ::chdir(options.directory.c_str()) != 0) ::_exit(127);
    if (options.file_size_limit >= 0) {
      const auto bytes = static_cast<rlim_t>(options.file_size_limit);
      const rlimit limit = {bytes, bytes};
      ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(out[1]);
  ::close(err[1]);
  ::fcntl(out[0], F_SETFL, O_NONBLOCK);
  ::fcntl(err[0], F_SETFL, O_NONBLOCK);

  ProgramResult result;
  int status = 0;
  rusage usage{};
  for (;;) {
    detail::readAvailable(out[0], result.out);
    detail::readAvailable(err[0], result.err);
    if (::wait4(child, &status, WNOHANG, &usage) == child) break;
    if (elapsed() > options.timeout_s) {
      result.timed_out = true;
      ::kill(child, SIGKILL);
    }
    if (options.while_running) options.while_running(child, result.err);
    pollfd descriptors[2] = {{out[0], POLLIN, 0}, {err[0], POLLIN, 0}};
    ::poll(descriptors, 2, 1);
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  result.seconds = elapsed();
  detail::readAvailable(out[0], result.out);
  detail::readAvailable(err[0], result.err);
  ::close(out[0]);
  ::close(err[0]);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  const auto seconds = [](const timeval& time) { return time.tv_sec + 1e-6 * time.tv_usec; };
  result.processor_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  result.peak_kilobytes = usage.ru_maxrss;
  return result;
}

}  // namespace planar_mapping
