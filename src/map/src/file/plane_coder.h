// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "file/belief_coder.h"
#include "file/bit_coder.h"
#include "file/lattice_coder.h"
#include "file/map_record.h"

namespace planar_mapping::detail {

/// Numbers in floating point, by their distance to a guess or to the last one.
class RoundedCoder {
 public:
  explicit RoundedCoder(int bits) : bits_(bits) {}
  void start() { last_ = 0; }  ///< of another map
  /// \param guess taken for the last number if that is not 0
  void code(BitCoder& coder, RoundedNumber& number, const RoundedNumber& guess = {});
  void forget() { forgetAll(zero_, step_); }

 private:
  int bits_;
  AdaptiveBit zero_;
  NumberModel step_;
  std::int64_t last_ = 0;
};

/// Normals, directions and origins of planes, as StoredPlane keeps them.
class PlaneFrameCoder {
 public:
  void start() { turns_ = {}; }  ///< of another map
  /// \throws Error
  void code(BitCoder& coder, StoredPlane& p);
  void forget();

 private:
  NumberModel turn_;
  std::array<NumberModel, 2> normal_;
  std::array<NumberModel, 3> origin_;
  SymbolModel<3> axis_;
  AdaptiveBit level_, reversed_;
  std::array<std::int32_t, 6> turns_{};  ///< the last one of each axis
};

/// The planes of a map (docs/file_format.md, "Planes").
class PlaneCoder {
 public:
  /// \param planes as many as there are, by id; they are filled when reading
  /// \param resolution side of a cell, metres
  /// \throws Error
  void code(BitCoder& coder, std::vector<PlaneRecord>& planes, double resolution,
            LatticeCount& count);
  void forget();

 private:
  struct Spread;
  void codeOne(BitCoder& coder, PlaneRecord& plane, std::int32_t last_id, double resolution,
               LatticeCount& count);
  void codeStored(BitCoder& coder, StoredPlane& p, const Spread& cells);

  NumberModel id_, frames_, anchor_, correlation_, slope_;
  PlaneFrameCoder frame_;
  std::array<NumberModel, 3> mean_;
  std::array<AdaptiveBit, 2> flat_;  ///< without height, with height
  RoundedCoder weight_{StoredPlane::kWeightBits};
  std::array<RoundedCoder, 2> variance_{RoundedCoder(StoredPlane::kVarianceBits),
                                        RoundedCoder(StoredPlane::kVarianceBits)};
  RoundedCoder residual_{StoredPlane::kVarianceBits};
  LatticeCoder tiles_{2, false};
  BeliefCoder beliefs_{2};
};

}  // namespace planar_mapping::detail
