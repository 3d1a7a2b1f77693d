// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "planar_mapping/planes/multi_plane.h"
#include "planar_mapping/planes/organized/organized_assignment.h"
#include "planar_mapping/planes/tiles/organized_growing.h"

// Disparity space: column X = f x / z, row Y = f y / z and disparity D = B f / z, all in pixels
// about the principal point. A plane of space is a plane D = p X + q Y + r there, and the error of
// a stereo camera is the same everywhere and along D alone, so that the plain regression of D is
// the best fit; in metres the error grows with z^2 and lies along oblique rays, which bends every
// fit across the plane.
namespace planar_mapping::detail {

/// Parameters of the search in disparity space. Matching errs smoothly over whole windows (towards
/// whole pixels, towards what stands out), which the residuals of windows do not show: by up to the
/// disparity error of the camera.
struct DisparityParams : SearchParams {
  DisparityParams(const MultiPlaneParams& params, const StereoNoise& noise_of_camera)
      : SearchParams(params), camera(noise_of_camera), noise(noise_of_camera.disparity_error) {}

  StereoNoise camera;  ///< its disparity error bounds the noise that is believed
  double noise;        ///< of one pixel, estimated from the frame, pixels
  /// Least noise that is believed, in disparity errors of the camera.
  double min_noise_fraction = 0.1;
  /// Sigmas by which the mean of a cell may lie off the plane it joins.
  double growing_factor = 2.5;
  /// Fraction of max_normal_deviation between the normal of a cell and the plane it joins.
  double growing_angle_fraction = 0.7;
  /// Smooth errors in the residuals of windows, in disparity errors ...
  double smooth_residual_fraction = 0.25;
  /// ... and in slopes, over the extent of a window.
  double smooth_slope_fraction = 0.15;
  /// Fraction of the noise within which planes that do not touch are one.
  double merging_apart_factor = 0.25;
  /// Fraction of the points in the quarters of a plane that must be on it and have a neighbourhood
  /// that lies as the plane does, ...
  double min_agreement = 0.8;
  /// ... where it is as flat as surfaces are: roughness cannot be taken for noise there.
  double min_flat_agreement = 0.6;
  /// Standard deviation of the direction of a plane that can be used, radians.
  double max_direction_error = 0.087;
  /// The same for what is rougher than this fraction of the disparity error of the camera and
  /// thicker than this fraction of its width, standard deviations across the plane and along its
  /// narrower side: trunks and shrubs are, so that there must be points enough to leave no doubt
  /// ...
  double max_thick_direction_error = 0.01;
  double rough_fraction = 0.34;
  double thick_fraction = 0.2;
  /// ... or, up to this error, nothing but noise in what lies off the plane: see isNoiseOfPlane().
  double max_noisy_direction_error = 0.02;
  int least_noisy_tiles = 20;
  double most_noisy_residual = 1.3;  ///< of the noise of the frame
  double noise_tile_fraction = 0.8;  ///< of the residual, in means of tiles

  /// B f, pixels times metres.
  double factor() const { return camera.baseline * camera.focal_length; }
  /// What counts whatever the distance: so many sigmas, or the smooth error.
  double tolerance(double sigmas) const { return std::max(sigmas * noise, camera.disparity_error); }
  double smoothResidual() const { return smooth_residual_fraction * camera.disparity_error; }
  /// Error of the slopes of a window, pixels of disparity per pixel.
  double slopeError(double extent, double count) const {
    const double independent = std::max(1.0, count / kCorrelatedPixels);
    const double smooth = smooth_slope_fraction * camera.disparity_error;
    return std::sqrt(noise * noise / independent + smooth * smooth) / extent;
  }
};

/// Regression of D in a cell or the window around it.
struct DisparityWindow {
  double p = 0.0, q = 0.0;           ///< slopes
  double x = 0.0, y = 0.0, d = 0.0;  ///< means, pixels
  double residual = 0.0;             ///< root mean square, pixels of disparity
  double extent = 0.0;               ///< root mean square, shorter axis of the image, pixels
  double count = 0.0;                ///< points; 0 if they do not span a plane
};

DisparityWindow fitDisparity(const MomentSums& sums);
std::vector<DisparityWindow> fitDisparities(const CellGrid& grid);

/// Planes in disparity space.
class DisparityFit : public PlaneFit {
 public:
  explicit DisparityFit(const DisparityParams& params) : params_(params) {}

  const DisparityParams& params() const { return params_; }
  void setNoise(double noise) { params_.noise = noise; }

  void fit(PlaneCandidate& plane) const override;
  bool areOne(const PlaneCandidate& one, const PlaneCandidate& other, bool adjacent,
              PlaneCandidate& joined) const override;
  CoherenceTest coherenceTest(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                              const PartList& list) const override;
  std::vector<char> agree(const PlaneCandidate& plane, const CellGrid& windows) const override;

  /// Unit normal towards the sensor and distance of it for D = p X + q Y + r, metres.
  void toMetres(double p, double q, double r, Vector3& normal, double& height) const;
  /// A distance from a plane (metres) at disparity \p d in pixels of disparity.
  static double toPixels(const PlaneCandidate& plane, double distance, double d) {
    return distance * d / plane.height;
  }
  /// Error of a slope in an image, turned into an angle of the plane at a pixel.
  double toAngle(double slope, double height, double x, double y, double d) const;

 private:
  /// Whether the means of tiles lie so much nearer to the plane than single pixels that these
  /// differ by noise of their own alone, not by a rough surface or by errors of matching.
  bool isNoiseWhite(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                    const PartList& list) const;

  DisparityParams params_;
};

class DisparityGrower : public CellGrower {
 public:
  DisparityGrower(const CellGrid& grid, const DisparityFit& fit);

  /// Of one pixel, pixels of disparity, from the residuals of windows.
  double noise();

 private:
  /// Which cells hold points enough to be planar: kAlone, kTogether with those around, or both.
  std::vector<std::uint8_t> findFilled() const;
  void classify() override;
  bool accepts(const PlaneCandidate& plane, const MomentSums& sums,
               const CellState& state) const override;

  const DisparityFit& fit_;
  /// Of 3 x 3 and 5 x 5 windows, of those that may be planar at least; empty = not made yet.
  std::vector<DisparityWindow> fits_[2];
};

/// Gives pixels to the plane nearest in disparity, in the tiles a plane was found in and those next
/// to them.
class DisparityAssigner : public PixelLabels {
 public:
  DisparityAssigner(const TiledCloud& cloud, const CellGrid& tiles, int threads)
      : PixelLabels(cloud, tiles, true, threads) {}
  /// Assigns all pixels anew.
  /// \param fraction of d_T and \param sigmas of the noise: the band that is a plane's, whichever
  ///        is wider
  void assign(const std::vector<PlaneCandidate>& planes, const DisparityParams& params,
              double fraction, double sigmas);
};

}  // namespace planar_mapping::detail
