// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/registration/surface_search.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_mapping/geometry/angles.h"

namespace planar_mapping::detail {
namespace {

constexpr double kSameWay = 0.17;      // radians between planes that face the same way
constexpr double kSameAngle = 0.1;     // between the angles of two pairs of directions
constexpr double kMinAngle = 0.5;      // between directions that fix a turn
constexpr double kMinFraction = 0.03;  // of all planes, that make a direction
/// Three fix a place, but every corner of a room has three: others must confirm it.
constexpr std::size_t kMinDistinct = 5;
constexpr std::size_t kMaxDirections = 8;
constexpr std::size_t kMaxTurns = 24;
constexpr std::size_t kMaxShifts = 4;  // along a direction
constexpr std::size_t kMaxCandidates = 6;
constexpr std::size_t kMaxPlanes = 300;  // that a pose is compared by
constexpr double kMaxBins = 10000.0;     // of offsets: what is farther away says nothing

/// Axes of two directions: between them, across and upright on both.
Matrix3 axesOf(const Vector3& a, const Vector3& b) {
  Matrix3 axes;
  axes.col(0) = (a + b).normalized();
  axes.col(2) = a.cross(b).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

/// So many bins on each side of zero hold the offsets of the planes.
int binsFor(const std::vector<Surfel>& planes, double bin) {
  double farthest = 0.0;
  for (const Surfel& plane : planes) farthest = std::max(farthest, plane.center.norm());
  return static_cast<int>(std::min(farthest / bin, kMaxBins)) + 2;
}

/// How many planes have each offset along a normal, in bins around zero.
std::vector<double> offsetsOf(const std::vector<Surfel>& planes, const FacingPlanes& facing,
                              const Vector3& normal, const Vector3& origin, double bin,
                              int half_bins) {
  std::vector<double> counts(static_cast<std::size_t>(2 * half_bins + 1), 0.0);
  for (const std::size_t i : facing.members) {
    const double at = normal.dot(planes[i].center - origin) / bin;
    if (!(std::abs(at) < half_bins)) continue;
    counts[static_cast<std::size_t>(static_cast<int>(std::lround(at)) + half_bins)] += 1.0;
  }
  return counts;
}

/// The best first; of equals the one that was found first.
template <typename Found>
void sortByWorth(std::vector<std::pair<double, Found>>& found) {
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
}

/// Those of most worth.
template <typename Found>
std::vector<Found> bestOf(std::vector<std::pair<double, Found>> found, std::size_t most) {
  sortByWorth(found);
  if (found.size() > most) found.resize(most);
  std::vector<Found> best;
  for (const auto& [worth, one] : found) best.push_back(one);
  return best;
}

/// Moves of the first counts onto the second, in bins, those that bring most together first.
std::vector<int> bestShifts(const std::vector<double>& from, const std::vector<double>& to,
                            int most) {
  std::vector<std::pair<double, int>> sums;
  const auto size = static_cast<int>(from.size());
  for (int shift = -most; shift <= most; ++shift) {
    double sum = 0.0;
    for (int i = std::max(0, -shift); i < std::min(size, size - shift); ++i) {
      sum += std::sqrt(from[static_cast<std::size_t>(i)] * to[static_cast<std::size_t>(i + shift)]);
    }
    sums.emplace_back(sum, shift);
  }
  sortByWorth(sums);
  std::vector<int> best;
  for (const auto& [sum, shift] : sums) {
    if (sum <= 0.0 || best.size() == kMaxShifts) break;
    const bool beside = std::any_of(best.begin(), best.end(), [&shift = shift](int other) {
      return std::abs(other - shift) <= 1;
    });
    if (!beside) best.push_back(shift);
  }
  return best;
}

/// Every way to choose one of each list.
template <typename Use>
void forEachChoice(const std::vector<std::vector<double>>& lists, std::size_t depth,
                   std::vector<double>& chosen, const Use& use) {
  if (depth == lists.size()) {
    use(chosen);
    return;
  }
  for (const double value : lists[depth]) {
    chosen[depth] = value;
    forEachChoice(lists, depth + 1, chosen, use);
  }
}

/// The directions that planes face, those of many planes first.
std::vector<FacingPlanes> facingPlanes(const std::vector<Surfel>& planes) {
  const double cosine = std::cos(kSameWay);
  std::vector<char> taken(planes.size(), 0);
  std::vector<FacingPlanes> directions;
  const auto membersOf = [&](const Vector3& normal) {
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < planes.size(); ++i) {
      if (taken[i] == 0 && planes[i].normal.dot(normal) > cosine) members.push_back(i);
    }
    return members;
  };
  const std::size_t stride = planes.size() / kMaxPlanes + 1;
  while (directions.size() < kMaxDirections) {
    FacingPlanes best;
    for (std::size_t i = 0; i < planes.size(); i += stride) {
      if (taken[i] != 0) continue;
      std::vector<std::size_t> members = membersOf(planes[i].normal);
      if (members.size() > best.members.size()) best = {planes[i].normal, std::move(members)};
    }
    if (static_cast<double>(best.members.size()) <
        std::max(3.0, kMinFraction * static_cast<double>(planes.size()))) {
      break;
    }
    for (int round = 0; round < 2; ++round) {
      Vector3 sum = Vector3::Zero();
      for (const std::size_t i : best.members) sum += planes[i].normal;
      best.normal = sum.normalized();
      best.members = membersOf(best.normal);
    }
    for (const std::size_t i : best.members) taken[i] = 1;
    directions.push_back(std::move(best));
  }
  return directions;
}

}  // namespace

SurfaceSearch::SurfaceSearch(const SurfaceMapParams& params, const BalancedPlanes& cloud,
                             std::vector<Surfel> map)
    : params_(params),
      cloud_(cloud),
      map_(std::move(map)),
      cloud_directions_(facingPlanes(cloud.planes)),
      map_directions_(facingPlanes(map_)),
      nearby_(map_, params.reach, CellShape::Plane) {}

/// Turns that bring two directions of the cloud onto two of the map, those first that bring most
/// others along.
std::vector<Matrix3> SurfaceSearch::turns() const {
  const auto worth = [&](const Matrix3& turn) {
    double sum = 0.0;
    for (const FacingPlanes& c : cloud_directions_) {
      for (const FacingPlanes& m : map_directions_) {
        if (angleBetween(turn * c.normal, m.normal) < kSameWay) {
          sum += std::sqrt(static_cast<double>(c.members.size()));
          break;
        }
      }
    }
    return sum;
  };
  std::vector<std::pair<double, Matrix3>> found;
  const auto add = [&](const Matrix3& turn) {
    for (const auto& [value, other] : found) {
      if (rotationAngle(turn * other.transpose()) < kSameWay) return;
    }
    found.emplace_back(worth(turn), turn);
  };
  for (std::size_t i = 0; i < cloud_directions_.size(); ++i) {
    for (std::size_t j = i + 1; j < cloud_directions_.size(); ++j) {
      const Vector3& a = cloud_directions_[i].normal;
      const Vector3& b = cloud_directions_[j].normal;
      const double angle = angleBetween(a, b);
      if (angle < kMinAngle || angle > M_PI - kMinAngle) continue;
      for (const FacingPlanes& k : map_directions_) {
        for (const FacingPlanes& l : map_directions_) {
          if (std::abs(angleBetween(k.normal, l.normal) - angle) > kSameAngle) continue;
          add(axesOf(k.normal, l.normal) * axesOf(a, b).transpose());
        }
      }
    }
  }
  return bestOf(std::move(found), kMaxTurns);
}

/// Places of the sensor with this turn, by the offsets of the planes along up to three directions.
std::vector<Vector3> SurfaceSearch::moves(const Matrix3& turn, const Pose& guess) const {
  const double bin = 2.0 * params_.cell;
  const int most = static_cast<int>(std::ceil(std::min(params_.search_reach / bin, kMaxBins)));
  std::vector<Vector3> normals;
  std::vector<std::vector<double>> shifts;
  std::vector<Surfel> turned = cloud_.planes;
  for (Surfel& plane : turned) plane.center = turn * plane.center;
  const int half_bins = binsFor(turned, bin) + most;
  Matrix3 untold = Matrix3::Identity();  // projects on what no direction so far tells
  for (const FacingPlanes& c : cloud_directions_) {
    for (const FacingPlanes& m : map_directions_) {
      if (angleBetween(turn * c.normal, m.normal) > kSameWay) continue;
      const Vector3 news = untold * m.normal;
      if (news.norm() < std::sin(kMinAngle)) continue;
      untold -= news.normalized() * news.normalized().transpose();
      const std::vector<double> from =
          offsetsOf(turned, c, m.normal, Vector3::Zero(), bin, half_bins);
      const std::vector<double> to =
          offsetsOf(map_, m, m.normal, guess.translation(), bin, half_bins);
      normals.push_back(m.normal);
      shifts.emplace_back();
      for (const int shift : bestShifts(from, to, most)) shifts.back().push_back(bin * shift);
    }
  }
  std::vector<Vector3> result;
  if (normals.size() < 2) return result;
  Eigen::MatrixXd system(static_cast<Eigen::Index>(normals.size()), 3);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    system.row(static_cast<Eigen::Index>(i)) = normals[i].transpose();
  }
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(system);
  std::vector<double> chosen(normals.size(), 0.0);
  forEachChoice(shifts, 0, chosen, [&](const std::vector<double>& along) {
    const Vector3 move = solver.solve(
        Eigen::Map<const Eigen::VectorXd>(along.data(), static_cast<Eigen::Index>(along.size())));
    if (move.norm() <= params_.search_reach) result.push_back(guess.translation() + move);
  });
  return result;
}

/// How well a plane of the cloud lies on the next one of the map, in [0, 1].
double SurfaceSearch::fitOf(const Surfel& plane, const Pose& T_world_sensor) const {
  const Vector3 q = T_world_sensor * plane.center;
  const Surfel* target = nearby_.nearest(q, T_world_sensor.linear() * plane.normal, params_.reach,
                                         std::cos(kMaxNormalAngle));
  if (target == nullptr) return 0.0;
  const double distance = target->normal.dot(q - target->center) / (2.0 * params_.cell);
  return std::max(0.0, 1.0 - distance * distance);
}

/// Of a sample of the cloud's planes, each direction counting the same.
double SurfaceSearch::fitOf(const Pose& T_world_sensor) const {
  const std::size_t stride = cloud_.planes.size() / kMaxPlanes + 1;
  double sum = 0.0;
  for (std::size_t i = 0; i < cloud_.planes.size(); i += stride) {
    sum += cloud_.weights[i] * fitOf(cloud_.planes[i], T_world_sensor);
  }
  return sum;
}

bool SurfaceSearch::knowsPlace(const Pose& T_world_sensor) const {
  std::vector<FacingPlanes> matched;
  std::size_t all = 0;
  for (const FacingPlanes& facing : cloud_directions_) {
    matched.push_back({facing.normal, {}});
    for (const std::size_t i : facing.members) {
      if (fitOf(cloud_.planes[i], T_world_sensor) > 0.0) matched.back().members.push_back(i);
    }
    all += matched.back().members.size();
  }
  const double bin = 2.0 * params_.cell;
  const double least = kMinFraction * static_cast<double>(all);
  const int half_bins = binsFor(cloud_.planes, bin);
  std::size_t distinct = 0;
  for (const FacingPlanes& facing : matched) {
    const std::vector<double> at =
        offsetsOf(cloud_.planes, facing, facing.normal, Vector3::Zero(), bin, half_bins);
    for (std::size_t i = 1; i + 1 < at.size(); ++i) {
      const bool peak = at[i] >= at[i - 1] && at[i] > at[i + 1];
      if (peak && at[i - 1] + at[i] + at[i + 1] >= least) ++distinct;
    }
  }
  return distinct >= kMinDistinct;
}

std::vector<Pose> SurfaceSearch::candidates(const Pose& guess) const {
  std::vector<std::pair<double, Pose>> found;
  for (const Matrix3& turn : turns()) {
    for (const Vector3& place : moves(turn, guess)) {
      Pose pose = Pose::Identity();
      pose.linear() = turn;
      pose.translation() = place;
      found.emplace_back(fitOf(pose), pose.inverse());
    }
  }
  return bestOf(std::move(found), kMaxCandidates);
}

}  // namespace planar_mapping::detail
