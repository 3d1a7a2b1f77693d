// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>

#include "planar_mapping/base/error.h"
#include "planar_mapping/beliefs/occupancy.h"

int main() {
  try {
    planar_mapping::updatedBelief(2.0, 0.5);
  } catch (const planar_mapping::Error&) {
    if (planar_mapping::updatedBelief(0.9, 0.9) > 0.99) std::puts("consumer works");
  }
}
