// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "planar_mapping/localization/registration/view_agreement.h"
#include "planar_mapping/localization/views/view_map.h"
#include "planar_mapping/stereo/features/feature_detection.h"

namespace planar_mapping {

/// An image with depth: its cells, and its features once they are needed.
class ViewMap::View {
 public:
  View() = default;
  View(const io::Image& image, const PointsView& cloud, const PinholeCamera& pinhole,
       const FeatureCamera& noise);

  /// Finds the features; image and depth are not needed any more then.
  void detect(const ViewMapParams& params);

  ViewCells cells;
  std::vector<FeatureSighting> sightings;
  detail::Descriptors descriptors;

 private:
  io::Image gray_;
  PinholeCamera camera_;
  std::vector<float> depths_;  ///< 0 = none
  bool detected_ = false;
};

constexpr double kHopelessView = 0.1;   ///< a score that chance gives
constexpr double kConfirmedView = 0.4;  ///< least correlation of a confirmed pose
constexpr int kCoarseView = 3;          ///< cells between those compared, where much is compared

/// Earlier views and where they were taken: how well a pose of another view agrees with them.
class ViewMap::PlacedViews {
 public:
  /// What the witnesses, the views next to it, say of a pose.
  struct Support {
    PoseVerdict verdict = PoseVerdict::Unknown;
    double score = 0.0;        ///< mean, by how much they see; at most 1
    double correlation = 0.0;  ///< likewise
    double agreeing = 0.0;     ///< likewise
    double through = 0.0;      ///< likewise
    double behind = 0.0;       ///< likewise
    double misfit = 1.0;       ///< likewise; 1 without a witness
    double overlap = 0.0;      ///< of the one that sees most
    bool contested = false;    ///< one of them contradicts, however little it sees
  };
  struct Hypothesis {
    Pose pose;
    Support support;
    std::size_t inliers = 0;      ///< features, where it is by them
    double match_fraction = 0.0;  ///< their fraction of the features that look alike
    double error = 0.0;           ///< largest standard deviation of its position, metres
    std::size_t off_plane = 0;    ///< of them, not on the plane that holds most
    bool fits = false;            ///< see PoseCandidate
  };

  explicit PlacedViews(const ViewMapParams& params) : params_(params) { params.validate(); }
  const ViewMapParams& params() const { return params_; }

  void insert(const ViewPtr& view, const Pose& T_world_sensor);
  bool empty() const { return views_.empty(); }
  /// The view taken next to a pose.
  const View& nextTo(const Pose& pose) const { return *nearestTo(pose).front()->view; }

  /// \param step     cells between those compared
  /// \param goes_on  the pose is just the expected one: the latest views are its witnesses, not the
  ///                 next ones, from which a camera that comes back may have drifted
  Support supportOf(const View& view, const Pose& T_world_sensor, int step,
                    bool goes_on = false) const;
  /// To the next maximum of the correlation.
  void climb(const View& view, Hypothesis& hypothesis) const;
  /// The best of each side along each axis that is open.
  std::vector<Hypothesis> shiftedOf(const View& view, const Pose& pose, double min_shift) const;
  /// Whether few of the features that the views next to a pose have, and that the view would show
  /// from about the same side, look the same where they would be: things repeat, or another wall
  /// has that shape. False where few are expected.
  bool missesFeatures(View& view, const Pose& T_world_sensor) const;
  /// Poses by features, from as many views as may be tried.
  std::vector<Hypothesis> registerTo(View& view, const Pose& guess) const;

  /// What moves the view by more than a few cells and the noise of its depths, metres.
  double shiftToElsewhere(const View& view) const;
  /// Whether what is seen moves by few cells between two poses.
  bool isSamePlace(const View& view, const Pose& a, const Pose& b) const;
  static double distance(const Pose& a, const Pose& b);

 private:
  struct Placed {
    ViewPtr view;
    Pose T_world_sensor = Pose::Identity();
  };

  std::vector<const Placed*> latest() const;
  std::vector<const Placed*> nearestTo(const Pose& pose) const;
  std::vector<const Placed*> attemptsFor(const Pose& guess) const;
  std::vector<Hypothesis> registerTo(View& view, const Placed& other, const Pose& guess) const;

  ViewMapParams params_;
  std::deque<Placed> views_;
};

}  // namespace planar_mapping
