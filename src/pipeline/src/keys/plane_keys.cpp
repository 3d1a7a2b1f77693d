// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "keys/plane_keys.h"

#include <algorithm>

namespace planar_mapping::detail {

void PlaneKeys::applyProfile(Profile profile) {
  if (profile != Profile::Paper) return;
  params.method = PlaneSearchMethod::MultiRansac;
  params.source = PlaneSource::Features;
  params.features.refine = false;
  assumed_probability = 0.0;
  noise.setSource(NoiseKeys::Source::None);
}

void PlaneKeys::declare(ParameterTable& table) {
  table.word("method", params.method,
             {{"automatic", PlaneSearchMethod::Automatic},
              {"multi_ransac", PlaneSearchMethod::MultiRansac},
              {"sequential", PlaneSearchMethod::Sequential},
              {"organized", PlaneSearchMethod::Organized},
              {"disparity", PlaneSearchMethod::Disparity}},
             "how planes are looked for");
  table.word("source", params.source,
             {{"dense", PlaneSource::Dense},
              {"features", PlaneSource::Features},
              {"auto", PlaneSource::Auto}},
             "what planes are found in: the dense points, the key features, whose planes the "
             "dense points are then given to (Eq. 11), or auto = the key features and then the "
             "dense points on none of their planes");
  table.integer("features", params.features.samples, Range::atLeast(8),
                "points sampled evenly from the cloud in place of key features, where a frame "
                "has none");
  table.integer("min_features", params.features.min_features, Range::atLeast(3),
                "[ours] key features on a plane, fewer could be chance");
  table.flag("refine", params.features.refine,
             "[ours] planes of key features keep only points that are a surface and are refitted "
             "to them; without, dense points only belong, as in the paper");
  table.number("distance_threshold_m", distance_threshold, Range::positive(),
               "d_T, Eq. 11; auto = half the automatic resolution");
  table.integer("min_inliers", min_inliers, Range::atLeast(3),
                "smallest plane that counts; auto = a 300th of the points, at least 50");
  table.integer("max_planes", params.max_planes, Range::atLeast(0), "0 = as many as there are");
  noise.declareOptional(table,
                        "the threshold follows the stereo noise, max(d_T, noise_factor * dz(z))");
  table.number("noise_factor", params.noise_factor, Range::atLeast(0.0), "k of the noise model");
  table.number("patch_gap_m", params.patch_gap, Range::atLeast(0.0),
               "[ours] points of one plane farther apart are separate patches; 0 = from the "
               "density");
  table.integer("number_of_models", params.number_of_models, Range::atLeast(0),
                "W of multi-RANSAC; 0 = by significance");
  table.integer("max_iterations", params.max_iterations, Range::atLeast(0),
                "of the random search; 0 = from the miss probability");
  table.number("miss_probability", params.miss_probability, Range::above(0.0, 0.5),
               "chance to miss a plane that is there");
  table.number("significance", params.significance, Range::atLeast(0.0),
               "[ours] standard deviations by which a plane must exceed clutter");
  table.number("max_normal_deviation_deg", params.max_normal_deviation, Range::above(0.0, 90.0),
               "[ours] largest angle between a plane and the surface at its points");
  table.number("assumed_probability", assumed_probability, Range::between(0.0, 1.0),
               "[ours] belief in a plane where a stereo camera measures nothing between its "
               "points, as the image is even: a white wall; 0 = none");
  table.basic({"source", "distance_threshold_m", "min_inliers", "noise", "noise_factor"});
}

void PlaneKeys::configure(const RunSettings& settings) {
  params.seed = settings.seed;
  params.threads = settings.threads;
  params.validate();
}

void PlaneKeys::adapt(const CloudScale& scale) {
  constexpr std::size_t kSmallest = 50;
  constexpr std::size_t kFraction = 300;
  if (!distance_threshold) distance_threshold = 0.5 * automaticResolution(scale);
  if (!min_inliers) {
    min_inliers = static_cast<int>(std::max(kSmallest, scale.points / kFraction));
  }
  up = scale.up;
  noise.adapt(scale);
  params.noise = noise.optionalNoise();
  params.distance_threshold = *distance_threshold;
  params.min_inliers = *min_inliers;
  params.validate();
}

}  // namespace planar_mapping::detail
