// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/base/export.h"

namespace planar_mapping::detail {

/// Whoever uses OpenCV has one of these meanwhile. The number of its threads is one for the whole
/// process, and setting it stops those that are at work: so the first one sets it, those that come
/// while it lives take it as it is, and the last one puts back what was before.
class PLANAR_MAPPING_EXPORT OpenCvThreads {
 public:
  /// As many as there are.
  OpenCvThreads();
  /// \param threads  0 = all cores
  explicit OpenCvThreads(int threads);
  ~OpenCvThreads();
  OpenCvThreads(const OpenCvThreads&) = delete;
  OpenCvThreads& operator=(const OpenCvThreads&) = delete;
};

}  // namespace planar_mapping::detail
