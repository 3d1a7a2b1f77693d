// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

namespace planar_mapping::detail {

/// What is there only while something is worked on. Copies are at rest: they have none.
template <typename Work>
struct Resting : std::unique_ptr<Work> {
  Resting() = default;
  Resting(const Resting&) : std::unique_ptr<Work>() {}
  Resting(Resting&&) noexcept = default;
  Resting& operator=(const Resting&) {
    this->reset();
    return *this;
  }
  Resting& operator=(Resting&&) noexcept = default;
};

}  // namespace planar_mapping::detail
