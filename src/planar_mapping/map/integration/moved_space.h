// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/map/store/unknown_space.h"

namespace planar_mapping::detail {

/// Space where a rigid motion puts it, on the same lattice: a cell is what the cell was in which
/// its middle lay before. What is alike is moved as a whole.
/// \param cell side of a cell, metres
/// \throws InputError if more than 65,536 regions of the result are not alike
UnknownSpace movedSpace(const UnknownSpace& space, double cell, const Pose& T);

}  // namespace planar_mapping::detail
