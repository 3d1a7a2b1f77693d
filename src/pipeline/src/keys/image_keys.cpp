// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "keys/image_keys.h"

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::detail {

void StereoKeys::declare(ParameterTable& table) {
  table.integer("min_disparity_px", matcher.min_disparity, Range::between(-2000, 2000),
                "smallest disparity looked for; auto = found in each pair by a coarse search");
  table.integer("disparities_px", matcher.disparities, Range::between(1, 2000),
                "how many are looked at; auto = found in each pair by a coarse search");
  table.number("near_distance_m", matcher.near_distance, Range::atLeast(0.0),
               "nothing nearer is looked for by the coarse search; 0 = max_disparity_fraction");
  table.number("max_disparity_fraction", matcher.max_disparity_fraction, Range::above(0.0, 1.0),
               "[ours] largest disparity of the coarse search, in image widths");
  table.word("paths", matcher.paths,
             {{"three", SmoothnessPaths::Three},
              {"five", SmoothnessPaths::Five},
              {"eight", SmoothnessPaths::Eight}},
             "directions along which smoothness adds up; more is slower");
  table.integer("block_size_px", matcher.block_size, Range::between(1, 31),
                "side of the window compared, odd");
  table.number("smoothness_small", matcher.smoothness_small, Range::between(0.0, 1000.0),
               "P1: cost of a step of 1 px, per pixel of the window");
  table.number("smoothness_large", matcher.smoothness_large, Range::between(0.0, 1000.0),
               "P2: cost of a larger step, likewise");
  table.integer("prefilter_cap", matcher.prefilter_cap, Range::between(1, 63),
                "horizontal gray value derivatives are cut off here");
  table.number("uniqueness_percent", matcher.uniqueness_percent, Range::between(0.0, 100.0),
               "the second-best disparity must cost so much more");
  table.number("left_right_tolerance_px", matcher.left_right_tolerance,
               Range::between(-1.0, 2000.0),
               "left and right disparities may differ by so much; negative = not checked");
  table.integer(
      "speckle_size_px", matcher.speckle_size, Range::atLeast(0),
      "connected regions of fewer pixels are removed, plain ones that agree little of fewer "
      "than four times as many; 0 = off");
  table.number("speckle_side_m", matcher.speckle_side, Range::between(0.0, 1000.0),
               "[ours] so are those that cover less than a square of this side where they are; 0 = "
               "off");
  table.number("speckle_range_px", matcher.speckle_range, Range::positive(),
               "neighbours whose disparities differ more are not connected");
  table.number("min_texture", matcher.min_texture, Range::between(0.0, 255.0),
               "[ours] where neighbours differ by less gray values on average, there is no "
               "disparity; 0 = off");
  table.number("min_agreement", matcher.min_agreement, Range::between(0.0, 1.0),
               "[ours] least correlation of the gradients of both images around a pixel, which "
               "noise does not have; half of it among pixels that have it; 0 = off");
  table.integer("texture_window_px", matcher.texture_window, Range::between(3, 255),
                "[ours] side of the windows of both, odd");
  table.flag("refine", matcher.refine,
             "[ours] least squares on gray values against the pull to whole disparities");
  table.integer("refine_window_px", matcher.refine_window, Range::between(3, 31),
                "[ours] side of its window, odd");
  table.number("min_brightness", min_brightness, Range::between(0.0, 255.0),
               "[ours] mean gray value of a frame that can be used");
  table.number("min_density", min_density, Range::between(0.0, 1.0),
               "[ours] fraction of the pixels of a usable frame that have a disparity");
  table.basic({"disparities_px", "paths", "uniqueness_percent", "speckle_side_m", "min_texture"});
}

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
