// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace planar_mapping::detail {

/// Numbers, ascending.
using CellSet = std::vector<std::uint32_t>;

/// Sets that together hold all numbers below \p elements, never more than \p start, which must do
/// so: local search with weights of elements (Gao, Weise and Li, "An efficient local search
/// heuristic with row weighting for the unicost set covering problem", EJOR 246, 2015), two steps
/// for each set. Deterministic.
/// \param start  numbers of sets, each once
/// \return numbers of sets, ascending
std::vector<std::size_t> fewerSets(std::size_t elements, const std::vector<CellSet>& sets,
                                   const std::vector<std::size_t>& start);

}  // namespace planar_mapping::detail
