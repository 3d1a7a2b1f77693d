// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "file/bit_coder.h"
#include "planar_mapping/map/store/planar_map_params.h"

namespace planar_mapping::detail {

/// All 64 bits of a number.
double codeDouble(BitCoder& coder, double value);

/// The parameters of a map (docs/file_format.md, "Content").
class ParameterCoder {
 public:
  /// \throws Error, ParameterError
  void code(BitCoder& coder, PlanarMapParams& p);
  /// Those that a finished map keeps; the others are the usual ones.
  void codeFinished(BitCoder& coder, PlanarMapParams& p);
  void forget();

 private:
  static constexpr std::size_t kMostKnown = 8;
  /// A parameter and the values that maps had so far.
  struct Known {
    std::vector<double> values;
    std::array<AdaptiveBit, kMostKnown> is_value;
  };
  void codeNumber(BitCoder& coder, std::size_t place, PlanarMapParams& p);
  void codeKinds(BitCoder& coder, PlanarMapParams& p);
  double codeOne(BitCoder& coder, Known& known, double value);
  double codeNew(BitCoder& coder, double value);

  static constexpr std::size_t kNumbers = 26;
  std::array<Known, kNumbers> known_;
  AdaptiveBit decimal_, compact_, unknown_space_;
  SymbolModel<3> places_;
  NumberModel digits_, min_points_;
};

}  // namespace planar_mapping::detail
