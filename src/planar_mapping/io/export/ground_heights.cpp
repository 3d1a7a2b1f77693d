// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/io/export/exported_map.h"
#include "planar_mapping/io/export/occupancy_grid.h"

namespace planar_mapping::io {
namespace {

struct Floor {
  double height = 0.0, area = 0.0;
};

/// The place on the upper face of a level cuboid that is next to a place above it.
Vector3 placeOn(const Cuboid& cuboid, const Vector3& up, const Vector3& above) {
  const Matrix3 axes = cuboid.orientation.toRotationMatrix();
  const Vector3 half = 0.5 * cuboid.size;
  // Down along the vertical onto the plane of the face, then to the nearest place within it.
  const Vector3 top = topOf(cuboid, up);
  const double drop = (above - top).dot(axes.col(2)) / up.dot(axes.col(2));
  Vector3 local = axes.transpose() * (above - drop * up - top);
  local = local.cwiseMax(-half).cwiseMin(half);
  local.z() = 0.0;
  return top + axes * local;
}

struct Surroundings {
  std::vector<std::pair<double, double>> faces;  ///< of level cuboids: height, area
  std::vector<const Cuboid*> cuboids;
  /// Of each place: height of the highest level face right under it; if none, minus infinity.
  std::vector<double> under;
};

/// What is around a few of the places a map was seen from, and the height of its faces there.
Surroundings around(const std::vector<Vector3>& sensors, const std::vector<Cuboid>& cuboids,
                    const Vector3& up) {
  constexpr double kAround = 15.0;          // metres: a scanner sees no ground nearer than 5
  constexpr double kLeastBelow = 0.05;      // metres
  constexpr double kUnder = 0.25;           // metres beside a place
  constexpr std::size_t kMaxSensors = 100;  // are enough
  Surroundings found;
  const std::size_t step =
      std::max<std::size_t>(1, (sensors.size() + kMaxSensors - 1) / kMaxSensors);
  found.under.assign((sensors.size() + step - 1) / step, -INFINITY);
  for (const Cuboid& cuboid : cuboids) {
    const bool is_level = isLevel(cuboid, up);
    double nearest = kAround;
    double height = 0.0;
    for (std::size_t i = 0; i < sensors.size(); i += step) {
      const Vector3 place = is_level ? placeOn(cuboid, up, sensors[i]) : cuboid.center;
      const Vector3 apart = place - sensors[i];
      const double beside = (apart - apart.dot(up) * up).norm();
      if (is_level && apart.dot(up) > -kLeastBelow) continue;
      if (is_level && beside <= kUnder)
        found.under[i / step] = std::max(found.under[i / step], place.dot(up));
      if (beside >= nearest) continue;
      nearest = beside;
      height = place.dot(up);
    }
    if (nearest == kAround) continue;
    found.cuboids.push_back(&cuboid);
    if (is_level) found.faces.emplace_back(height, cuboid.size.x() * cuboid.size.y());
  }
  return found;
}

Surroundings everything(const std::vector<Cuboid>& cuboids, const Vector3& up) {
  Surroundings all;
  for (const Cuboid& cuboid : cuboids) {
    all.cuboids.push_back(&cuboid);
    if (!isLevel(cuboid, up)) continue;
    all.faces.emplace_back(cuboid.center.dot(up) + 0.5 * cuboid.size.z(),
                           cuboid.size.x() * cuboid.size.y());
  }
  return all;
}

/// The level faces at the height of those that most of the places are right above.
std::optional<Floor> stoodOver(Surroundings& here, double same_floor) {
  if (here.under.empty()) return std::nullopt;
  const double middle = detail::ranked(here.under, here.under.size() / 2);
  const auto isSame = [&](double height) { return std::abs(height - middle) <= same_floor; };
  const auto count = std::count_if(here.under.begin(), here.under.end(), isSame);
  if (2 * static_cast<std::size_t>(count) < here.under.size()) return std::nullopt;
  Floor floor;
  for (const auto& [height, area] : here.faces) {
    if (!isSame(height)) continue;
    floor.area += area;
    floor.height += (height - floor.height) * area / floor.area;
  }
  return floor;
}

/// What most places are right above, if level faces below it are far smaller: a pit in a floor.
/// Else of the lowest level faces that are larger than tables or, where those are small beside
/// faces above them, of these; if next to nothing is below. Of a floor that leans, where most of it
/// is.
std::optional<double> floorHeight(Surroundings here, const Vector3& up) {
  constexpr double kMaxBelow = 0.1;   // of the volume: flying pixels below a floor reach 0.08
  constexpr double kMinArea = 4.0;    // square metres
  constexpr double kSameFloor = 0.2;  // metres
  constexpr double kStep = 0.6;       // metres: from a verge or a ditch to the road
  constexpr double kLarger = 4.0;     // times, up to such a step
  constexpr double kFarLarger = 8.0;  // times, above it: a floor beside a pit, not a table over it
  constexpr double kBelow = 0.7;      // metres: what starts there may be below a floor
  std::vector<std::pair<double, double>>& faces = here.faces;
  std::sort(faces.begin(), faces.end());
  std::vector<std::pair<double, double>> volumes;  // height, volume of all up to it
  for (const Cuboid* cuboid : here.cuboids)
    volumes.emplace_back(cuboid->center.dot(up), cuboid->volume());
  std::sort(volumes.begin(), volumes.end());
  for (std::size_t i = 1; i < volumes.size(); ++i) volumes[i].second += volumes[i - 1].second;
  const auto isLowest = [&](double height) {
    const auto above =
        std::lower_bound(volumes.begin(), volumes.end(), std::pair(height - kBelow, 0.0));
    return above == volumes.begin() || (above - 1)->second <= kMaxBelow * volumes.back().second;
  };
  if (const std::optional<Floor> stood = stoodOver(here, kSameFloor)) {
    double below = 0.0;
    for (const auto& [height, area] : faces)
      below += height < stood->height - kSameFloor ? area : 0.0;
    if (stood->area >= std::max(kMinArea, kFarLarger * below)) return stood->height;
  }
  std::optional<Floor> found;
  Floor most;   // of the floor that was found, where most of it is
  Floor floor;  // of the faces up to so much above one of them
  double moment = 0.0;
  std::size_t last = 0;
  for (const auto& [lowest, area] : faces) {
    for (; last < faces.size() && faces[last].first <= lowest + kSameFloor; ++last) {
      floor.area += faces[last].second;
      moment += faces[last].first * faces[last].second;
    }
    floor.height = moment / floor.area;
    const bool is_step = !found || lowest <= found->height + kStep;
    const bool replaces =
        floor.area >= (found ? (is_step ? kLarger : kFarLarger) * found->area : kMinArea);
    const bool goes_on = found && lowest <= most.height + kSameFloor && floor.area >= most.area;
    if (replaces || goes_on) {
      if (!isLowest(floor.height)) break;  // nor is what is higher
      if (replaces) found = floor;
      most = floor;
    }
    floor.area -= area;
    moment -= lowest * area;
  }
  return found ? std::optional(most.height) : std::nullopt;
}

}  // namespace

bool isLevel(const Cuboid& cuboid, const Vector3& up) {
  constexpr double kMinUpright = 0.98;
  return cuboid.plane_id >= 0 &&
         std::abs((cuboid.orientation * Vector3::UnitZ()).dot(up)) > kMinUpright;
}

Vector3 topOf(const Cuboid& cuboid, const Vector3& up) {
  const Vector3 normal = cuboid.orientation.toRotationMatrix().col(2);
  return cuboid.center + (normal.dot(up) > 0.0 ? 0.5 : -0.5) * cuboid.size.z() * normal;
}

double groundHeight(const std::vector<Cuboid>& cuboids, const Vector3& up,
                    const std::vector<Vector3>& sensors) {
  constexpr double kStrayFraction = 0.01;
  constexpr double kNearZero = 0.1;  // metres
  std::optional<double> floor = floorHeight(around(sensors, cuboids, up), up);
  if (!floor) floor = floorHeight(everything(cuboids, up), up);
  if (floor) return std::abs(*floor) <= kNearZero ? 0.0 : *floor;
  std::vector<std::pair<double, double>> ends;  // height, weight
  double stray = 0.0;
  for (const Cuboid& cuboid : cuboids) {
    const Vector3 local = (cuboid.orientation.conjugate() * up).cwiseAbs();
    // One walks on a floor, not below it.
    const bool lies = isLevel(cuboid, up);
    ends.emplace_back(cuboid.center.dot(up) + (lies ? 0.5 : -0.5) * local.dot(cuboid.size),
                      cuboid.volume());
    stray += kStrayFraction * cuboid.volume();
  }
  if (ends.empty()) return 0.0;
  std::sort(ends.begin(), ends.end());
  double lowest = ends.front().first;
  for (const auto& [height, weight] : ends) {
    lowest = height;
    stray -= weight;
    if (stray <= 0.0) break;
  }
  return lowest >= -0.35 && lowest <= 1.0 ? 0.0 : lowest;
}

GroundHeights::GroundHeights(const std::vector<GroundPoint>& ground, const Vector3& up,
                             double elsewhere)
    : turn_(turning(up, Vector3::UnitZ())),
      lowest_(elsewhere),
      highest_(elsewhere),
      middle_(elsewhere),
      heights_(1, static_cast<float>(elsewhere)) {
  constexpr std::size_t kFewest = 2;     // of 4 square metres each
  constexpr double kSide = 2.0;          // metres, of PlanarMap::ground()
  constexpr double kMaxCells = 1000000;  // of the raster
  if (ground.size() < kFewest) return;
  std::vector<Vector3> places;
  Vector2 high = Vector2::Constant(-INFINITY);
  low_ = Vector2::Constant(INFINITY);
  for (const GroundPoint& point : ground) {
    places.push_back(turn_ * point.position);
    low_ = low_.cwiseMin(places.back().head<2>());
    high = high.cwiseMax(places.back().head<2>());
  }
  cell_ = std::max(kSide, std::sqrt((high - low_).prod() / kMaxCells));
  size_ = ((high - low_) / cell_).array().round().cast<int>() + 1;
  const auto count = static_cast<std::size_t>(size_.x()) * static_cast<std::size_t>(size_.y());
  heights_.assign(count, std::numeric_limits<float>::quiet_NaN());
  std::vector<std::uint32_t> points(count, 0);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Vector2 place = placeOf(places[k]).array().round();
    const auto i = static_cast<std::size_t>(place.y() * size_.x() + place.x());
    if (!std::isnan(heights_[i]) && ground[k].points <= points[i]) continue;
    points[i] = ground[k].points;
    heights_[i] = static_cast<float>(places[k].z());
  }
  std::vector<float> all;
  for (const float height : heights_)
    if (!std::isnan(height)) all.push_back(height);
  middle_ = detail::ranked(all, all.size() / 2);
  const auto [lowest, highest] = std::minmax_element(all.begin(), all.end());
  lowest_ = *lowest;
  highest_ = *highest;
  spread();
}

/// Cells without ground get the height of the nearest ones that have it.
void GroundHeights::spread() {
  std::vector<int> queue;
  for (std::size_t i = 0; i < heights_.size(); ++i)
    if (!std::isnan(heights_[i])) queue.push_back(static_cast<int>(i));
  for (std::size_t k = 0; k < queue.size(); ++k) {
    const int x = queue[k] % size_.x();
    const int y = queue[k] / size_.x();
    for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
      if (x + dx < 0 || x + dx >= size_.x() || y + dy < 0 || y + dy >= size_.y()) continue;
      const int other = queue[k] + dx + dy * size_.x();
      if (!std::isnan(heights_[static_cast<std::size_t>(other)])) continue;
      heights_[static_cast<std::size_t>(other)] = heights_[static_cast<std::size_t>(queue[k])];
      queue.push_back(other);
    }
  }
}

/// In cells from the middle of the first one, within those of the rim.
Vector2 GroundHeights::placeOf(const Vector3& turned) const {
  const Vector2 last = size_.cast<double>().matrix() - Vector2::Ones();
  const Vector2 at = (turned.head<2>() - low_) / cell_;
  return at.cwiseMax(0.0).cwiseMin(last);
}

/// Between the middles of four cells; if it is too steep there to be one ground, the highest.
double GroundHeights::at(const Vector3& point) const {
  constexpr double kSteep = 0.25;  // of the way: a garage's ramp
  const Vector2 place = placeOf(turn_ * point);
  const Eigen::Array2i first = place.array().cast<int>();
  const Eigen::Array2i next = (first + 1).min(size_ - 1);
  const Vector2 part = place - first.cast<double>().matrix();
  const auto height = [this](int x, int y) {
    return double{heights_[static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x()) +
                           static_cast<std::size_t>(x)]};
  };
  const auto [low, high] = std::minmax({height(first.x(), first.y()), height(next.x(), first.y()),
                                        height(first.x(), next.y()), height(next.x(), next.y())});
  if (high - low > kSteep * cell_) return high;
  const auto along = [&](int y) {
    return (1.0 - part.x()) * height(first.x(), y) + part.x() * height(next.x(), y);
  };
  return (1.0 - part.y()) * along(first.y()) + part.y() * along(next.y());
}

}  // namespace planar_mapping::io
