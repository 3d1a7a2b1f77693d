// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "keys/feature_keys.h"

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::detail {

void FeatureKeys::declare(ParameterTable& table) {
  table.word("source", source,
             {{"auto", Source::Auto}, {"image", Source::Image}, {"cloud", Source::Cloud}},
             "[ours] where features come from; auto = the image, where there is one of the same "
             "size as the cloud, else the cloud");
  table.word("registered", registered,
             {{"auto", Registered::Auto}, {"true", Registered::Yes}, {"false", Registered::No}},
             "[ours] whether the colour image of a depth camera shows at each pixel what its "
             "depth is of; false = it is left out; auto = where edges of depth meet those of the "
             "image only elsewhere, it is scaled and shifted to there");
  table.word("detector", tracker.detector,
             {{"auto", FeatureDetector::Automatic},
              {"surf", FeatureDetector::Surf},
              {"sift", FeatureDetector::Sift},
              {"orb", FeatureDetector::Orb},
              {"akaze", FeatureDetector::Akaze}},
             "of images; auto = SURF (the paper)");
  table.integer("max_features", tracker.max_features, Range::between(8, 20000),
                "of one image, spread evenly over it");
  table.number("detection_threshold", tracker.detection_threshold, Range::atLeast(0.0),
               "weakest response, in the detector's unit; 0 = its usual one");
  table.number("epipolar_tolerance_px", tracker.epipolar_tolerance, Range::between(0.0, 100.0),
               "[ours] rows of left and right feature may differ by so much");
  table.number("stereo_ratio", tracker.stereo_ratio, Range::above(0.0, 1.0),
               "[ours] best over second-best descriptor distance along the row, at most");
  table.number("track_ratio", tracker.track_ratio, Range::above(0.0, 1.0),
               "[ours] best over second-best descriptor distance between frames, at most");
  table.number("min_disparity_px", tracker.min_disparity, Range::between(0.0, 1000.0),
               "[ours] features of smaller disparity are too far to be of use");
  table.number("max_disparity_fraction", tracker.max_disparity_fraction, Range::above(0.0, 1.0),
               "[ours] largest disparity, in image widths");
  table.integer("refine_window_px", tracker.refine_window, Range::between(5, 41),
                "[ours] side of the window of the sub-pixel disparity, odd");
  table.integer("track_window_px", tracker.track_window, Range::between(5, 41),
                "[ours] side of the window of the place in a new image, odd");
  table.number("max_refine_residual", tracker.max_refine_residual, Range::above(0.0, 2.0),
               "[ours] gray values in a window may differ by this fraction of their deviation");
  table.flag("refine_tracks", tracker.refine_tracks,
             "[ours] places in a new image follow from gray values of the one before");
  table.integer("remember_frames", tracker.remember_frames, Range::between(0, 1000000),
                "[ours] a feature lost for so many frames keeps its identity when seen again");
  table.integer("max_remembered", tracker.max_remembered, Range::between(0, 100000),
                "[ours] lost features kept, the latest");
  table.number("cell_m", sampler.cell, Range::between(1e-6, 1e6),
               "[ours] features of clouds: one in each cell of this side");
  table.integer("cell_points", sampler.min_points, Range::atLeast(1),
                "[ours] features of clouds: points in such a cell");
  table.integer("max_cells", sampler.max_features, Range::between(1, 1000000),
                "[ours] features of clouds: at most");
  table.basic({"source", "detector", "max_features"});
}

void FeatureKeys::configure(int threads) {
  if (source == Source::Image && registered == Registered::No)
    throw ParameterError("source 'image' and registered 'false' leave nothing to look at");
  tracker.threads = threads;
  sampler.remember_frames = tracker.remember_frames;
}

}  // namespace planar_mapping::detail
