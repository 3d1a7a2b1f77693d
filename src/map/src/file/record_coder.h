// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "file/belief_coder.h"
#include "file/bit_coder.h"
#include "file/lattice_coder.h"
#include "file/map_record.h"
#include "file/octant_coder.h"
#include "file/parameter_coder.h"
#include "file/plane_coder.h"
#include "file/pose_coder.h"

namespace planar_mapping::detail {

/// All that learns while a map is coded (docs/file_format.md, "Content").
class RecordCoder {
 public:
  /// One that has learnt from nothing yet.
  RecordCoder() = default;
  /// One that has read the prior maps: a small file would be over before anything is learnt.
  static RecordCoder experienced();

  /// Codes the record or, when reading, fills it. \return the fewest bytes it must take
  /// \throws Error
  std::size_t code(BitCoder& coder, MapRecord& record);

 private:
  void codeCells(BitCoder& coder, MapRecord& record, LatticeCount& count);
  void forget();

  ParameterCoder params_;
  NumberModel frame_count_, next_plane_, plane_count_;
  PoseCoder poses_;
  PlaneCoder planes_;
  NumberModel anchor_;
  LatticeCoder blocks_{3, false};
  BeliefCoder beliefs_{3};
  OctantCoder octants_;
  NumberModel region_count_, region_frame_;
  LatticeCoder space_{3, true};
};

}  // namespace planar_mapping::detail
