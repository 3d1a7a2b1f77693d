// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/packed_boxes.h"

#include <array>
#include <optional>

#include "cuboids/half_cell_box.h"
#include "store/packed_numbers.h"

namespace planar_mapping::detail {
namespace {

constexpr unsigned kOnLattice = 1;
constexpr unsigned kCertain = 2;

}  // namespace

PackedBoxes::PackedBoxes(const std::vector<Cuboid>& boxes, double cell)
    : size_(static_cast<std::uint32_t>(boxes.size())) {
  const double half = 0.5 * cell;
  PackWriter out;
  std::array<std::int64_t, 3> last{};
  for (const Cuboid& c : boxes) {
    const std::optional<HalfCellBox> box = HalfCellBox::from(c, half);
    const bool certain = c.probability == 1.0f;
    out.byte((box ? kOnLattice : 0) | (certain ? kCertain : 0));
    out.difference(c.plane_id);
    if (!certain) out.raw(c.probability);
    if (box) {
      out.number(box->axes);
      for (std::size_t i = 0; i < 3; ++i) {
        out.difference(box->middle[i] - last[i]);
        out.difference(box->size[i]);
      }
      last = box->middle;
      continue;
    }
    for (int i = 0; i < 3; ++i) {
      out.raw(c.center[i]);
      out.raw(c.size[i]);
    }
    for (int i = 0; i < 4; ++i) out.raw(c.orientation.coeffs()[i]);
  }
  bytes_ = PackedBytes(out.bytes);
}

void PackedBoxes::appendTo(std::vector<Cuboid>& boxes, double cell) const {
  const double half = 0.5 * cell;
  PackReader in(bytes_.data());
  std::array<std::int64_t, 3> last{};
  for (std::uint32_t n = 0; n < size_; ++n) {
    const unsigned head = in.byte();
    const auto plane_id = in.differenceAs<std::int32_t>();
    const float probability = (head & kCertain) != 0 ? 1.0f : in.raw<float>();
    Cuboid c;
    if ((head & kOnLattice) != 0) {
      HalfCellBox box;
      box.axes = in.as<unsigned>();
      for (std::size_t i = 0; i < 3; ++i) {
        last[i] += in.difference();
        box.size[i] = in.difference();
      }
      box.middle = last;
      c = box.cuboid(half);
    } else {
      for (int i = 0; i < 3; ++i) {
        c.center[i] = in.raw<double>();
        c.size[i] = in.raw<double>();
      }
      for (int i = 0; i < 4; ++i) c.orientation.coeffs()[i] = in.raw<double>();
    }
    c.plane_id = plane_id;
    c.probability = probability;
    boxes.push_back(c);
  }
}

}  // namespace planar_mapping::detail
