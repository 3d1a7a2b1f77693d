// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

#include "file/bit_coder.h"
#include "file/finished_record.h"
#include "file/lattice_coder.h"
#include "file/parameter_coder.h"
#include "file/plane_coder.h"
#include "file/point_set_coder.h"

namespace planar_mapping::detail {

/// All that learns while a finished map is coded (docs/finished_map.md, "Content").
class FinishedCoder {
 public:
  /// One that has learnt from nothing yet.
  FinishedCoder() = default;
  /// One that has read the prior maps.
  static FinishedCoder experienced();

  /// Codes the record or, when reading, fills it. \return the fewest bytes it must take
  /// \throws Error
  std::size_t code(BitCoder& coder, FinishedRecord& record);

 private:
  /// Lengths along an axis, by that along the axis before.
  class Lengths {
   public:
    std::int64_t code(BitCoder& coder, std::int64_t length, std::int64_t before);
    void forget();

   private:
    static constexpr std::size_t kKinds = 6;
    std::array<NumberModel, kKinds> models_;
  };

  void codePlane(BitCoder& coder, FinishedPlane& plane, std::int32_t last_id);
  void codeRectangles(BitCoder& coder, std::vector<CellRectangle>& rectangles);
  void codeBoxes(BitCoder& coder, std::vector<FinishedBox>& boxes);
  void codePlaneOf(BitCoder& coder, FinishedBox& box);
  void codeAxes(BitCoder& coder, unsigned& axes);
  void codeFree(BitCoder& coder, FreeCuboid& cuboid);
  /// \return so many, when reading no more than the bytes allow
  std::size_t codeCount(BitCoder& coder, NumberModel& model, std::size_t count);
  void forget();

  ParameterCoder params_;
  NumberModel plane_count_, rectangle_count_, box_count_, free_count_;
  NumberModel id_;
  PlaneFrameCoder frame_;
  SymbolModel<4> spread_;
  PointSetCoder places_, corners_;
  std::array<Lengths, 2> sides_;
  std::array<Lengths, 3> edges_;
  AdaptiveBit on_plane_, same_plane_;
  NumberModel plane_;
  SymbolModel<3> normal_axis_;
  SymbolModel<2> direction_axis_;
  std::array<NumberModel, 4> free_numbers_;  ///< centre, size, quaternion, plane
  LatticeCoder space_{3, true};
  std::size_t cuboids_ = 0;      ///< of the map that is coded
  std::int32_t last_plane_ = 0;  ///< of a box
};

}  // namespace planar_mapping::detail
