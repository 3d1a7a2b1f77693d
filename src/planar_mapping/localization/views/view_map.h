// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/localization/registration/surface_map.h"

namespace planar_mapping {

/// Parameters of ViewMap; all [ours].
struct PLANAR_MAPPING_EXPORT ViewMapParams {
  FeatureCamera camera;     ///< noise of the points
  int max_features = 1500;  ///< of a view
  std::uint64_t seed = 12345;
  int threads = 1;  ///< 0 = all cores; changes nothing but the time

  /// \throws ParameterError
  void validate() const;
};

/// Whether a pose is the one explanation of a view.
enum class PoseVerdict : std::uint8_t {
  Confirmed,  ///< depths and gray values agree with earlier views
  Unknown,    ///< too little in common with earlier views, or too little texture, to tell
  Doubtful,   ///< gray values hardly agree
  Refused,    ///< what was measured lies where an earlier view saw through, or gray values differ
  Ambiguous,  ///< it agrees as well at another place
};

/// What is known of a view before it is searched for.
enum class ViewGuess : std::uint8_t {
  Motion,   ///< where it is expected, by the motion before
  Place,    ///< where the camera was: nobody knows how far it has moved
  Nothing,  ///< the view may show what was never seen
};

/// Earlier views of a camera with depth: tells whether a pose agrees with them, and finds the pose
/// of a view far from where it is expected, by descriptors that hold over wide baselines (SIFT).
class PLANAR_MAPPING_EXPORT ViewMap {
 public:
  /// An image and its depth. Its features are found when they are first needed.
  class View;
  class PlacedViews;
  using ViewPtr = std::shared_ptr<View>;

  explicit ViewMap(const ViewMapParams& params = ViewMapParams());
  ~ViewMap();
  ViewMap(ViewMap&&) noexcept;
  ViewMap& operator=(ViewMap&&) noexcept;

  /// \param cloud  organized, of the size of the image
  /// \throws InputError for other sizes
  ViewPtr see(const io::Image& image, const PointsView& cloud, const PinholeCamera& camera) const;
  void insert(const ViewPtr& view, const Pose& T_world_sensor);
  bool empty() const;

  /// \param expected  where the view is expected, or null where nothing is known: a pose far from
  ///                  there must not agree at another place as well
  /// \param strict    gray values must agree very well: the view may show what was never seen
  PoseVerdict check(const ViewPtr& view, const Pose& T_world_sensor, const Pose* expected,
                    bool strict) const;

  /// Whether depths agree far better at one pose than at another, more than a little apart, and
  /// gray values no worse. A turn and a shift that make up for each other hardly move what lies at
  /// one depth, so that features alone may confuse them.
  bool fitsBetter(const ViewPtr& view, const Pose& one, const Pose& other) const;
  /// Whether what is seen leaves a direction open, in which walls and panels may repeat.
  static bool leavesOpen(const ViewPtr& view);
  /// Whether depths agree so badly that there may be a pose where they do better.
  bool fitsBadly(const ViewPtr& view, const Pose& T_world_sensor) const;

  /// The next pose at which depths and gray values agree best.
  /// \return nothing if that is another place: farther than noise and a few pixels explain
  std::optional<Pose> refined(const ViewPtr& view, const Pose& T_world_sensor) const;

  /// The pose that very many features give, if none else has half of them and gray values agree at
  /// what lies at the same depth; the rest may have moved.
  std::optional<Pose> locateByFeatures(const ViewPtr& view, const Pose& guess) const;

  struct Location {
    bool found = false;
    std::string reason;  ///< if it is not
    Pose T_world_sensor = Pose::Identity();
  };
  /// The pose at which depths and gray values agree best, if there is no other like it.
  /// \param candidates  poses to try beside those that descriptors give; one that fits needs less
  /// \param known       the less, the more it takes to believe a pose; many features suffice
  Location locate(const ViewPtr& view, const Pose& guess,
                  const std::vector<PoseCandidate>& candidates, ViewGuess known) const;

 private:
  std::unique_ptr<PlacedViews> views_;
};

}  // namespace planar_mapping
