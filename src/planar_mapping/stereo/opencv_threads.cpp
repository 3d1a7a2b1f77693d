// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/opencv_threads.h"

#include <algorithm>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <optional>

#include "planar_mapping/base/parallel.h"

namespace planar_mapping::detail {
namespace {

std::mutex mutex;
int users = 0;
int before = 0;  // threads, of the first user

/// \param threads  nothing = as many as there are
void enter(std::optional<int> threads) {
  const std::lock_guard<std::mutex> lock(mutex);
  if (users++ > 0) return;
  before = cv::getNumThreads();
  if (threads.value_or(before) != before) cv::setNumThreads(*threads);
}

}  // namespace

OpenCvThreads::OpenCvThreads() {
  enter(std::nullopt);
}

// More threads than cores only make its scheduler complain on the terminal.
OpenCvThreads::OpenCvThreads(int threads) {
  enter(std::min(resolveThreads(threads), cv::getNumberOfCPUs()));
}

OpenCvThreads::~OpenCvThreads() {
  const std::lock_guard<std::mutex> lock(mutex);
  if (--users == 0 && cv::getNumThreads() != before) cv::setNumThreads(before);
}

}  // namespace planar_mapping::detail
