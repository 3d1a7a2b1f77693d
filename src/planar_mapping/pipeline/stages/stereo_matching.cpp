// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/matching/stereo_matcher.h"

#include <string>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/rounded.h"
#include "planar_mapping/pipeline/stages/builtin.h"
#include "planar_mapping/stereo/rectification.h"

namespace planar_mapping {
namespace {

/// Why the images are no pair; empty if they are. \throws InputError if the input has no pairs
std::string problemOf(const FrameImages& images) {
  const io::Image& left = images.left;
  const io::Image& right = images.right;
  if (left.empty() && right.empty())
    throw InputError(
        "the input has no image pairs, which stereo_matching needs; take it out of "
        "the configuration for inputs that bring depth or clouds");
  if (!images.calibration) throw InputError("an image pair needs a calib.yaml");
  if (left.empty() || right.empty())
    return std::string("there is no ") + (left.empty() ? "left" : "right") + " image";
  const auto size = [](const io::Image& image) {
    return std::to_string(image.width) + " x " + std::to_string(image.height);
  };
  if (size(left) == size(right)) return "";
  return "the left image is " + size(left) + " pixels, the right one " + size(right);
}

/// Why the disparities of a pair are of no use; empty if they are.
std::string problemOf(const StereoReport& report, double min_brightness, double min_density) {
  if (report.brightness < min_brightness)
    return "the left image is black: its mean gray value is " +
           detail::rounded(report.brightness, 1) + " of 255";
  if (report.swapped) return "left and right images seem to be exchanged: disparities are negative";
  if (report.density >= min_density) return "";
  return "only " + detail::rounded(100.0 * report.density, 1) +
         " % of the pixels have a disparity: there is no texture, or left and right do not belong "
         "together (neighbouring pixels differ by " +
         detail::rounded(report.contrast, 1) + " gray values on average)";
}

class StereoMatchingStage : public Stage {
 public:
  static constexpr const char* kName = "stereo_matching";
  static constexpr const char* kSummary =
      "dense disparity of an image pair, and the organized cloud it stands for (the paper, III-B)";
  static constexpr StageKind kKind = StageKind::Images;

  void declare(ParameterTable& table) override {
    table.integer("min_disparity_px", params_.min_disparity, Range::between(-2000, 2000),
                  "smallest disparity looked for; auto = found in each pair by a coarse search");
    table.integer("disparities_px", params_.disparities, Range::between(1, 2000),
                  "how many are looked at; auto = found in each pair by a coarse search");
    table.number("near_distance_m", params_.near_distance, Range::atLeast(0.0),
                 "nothing nearer is looked for by the coarse search; 0 = max_disparity_fraction");
    table.number("max_disparity_fraction", params_.max_disparity_fraction, Range::above(0.0, 1.0),
                 "[ours] largest disparity of the coarse search, in image widths");
    table.word("paths", params_.paths,
               {{"three", SmoothnessPaths::Three},
                {"five", SmoothnessPaths::Five},
                {"eight", SmoothnessPaths::Eight}},
               "directions along which smoothness adds up; more is slower");
    table.integer("block_size_px", params_.block_size, Range::between(1, 31),
                  "side of the window compared, odd");
    table.number("smoothness_small", params_.smoothness_small, Range::between(0.0, 1000.0),
                 "P1: cost of a step of 1 px, per pixel of the window");
    table.number("smoothness_large", params_.smoothness_large, Range::between(0.0, 1000.0),
                 "P2: cost of a larger step, likewise");
    table.integer("prefilter_cap", params_.prefilter_cap, Range::between(1, 63),
                  "horizontal gray value derivatives are cut off here");
    table.number("uniqueness_percent", params_.uniqueness_percent, Range::between(0.0, 100.0),
                 "the second-best disparity must cost so much more");
    table.number("left_right_tolerance_px", params_.left_right_tolerance,
                 Range::between(-1.0, 2000.0),
                 "left and right disparities may differ by so much; negative = not checked");
    table.integer(
        "speckle_size_px", params_.speckle_size, Range::atLeast(0),
        "connected regions of fewer pixels are removed, plain ones that agree little of fewer "
        "than four times as many; 0 = off");
    table.number(
        "speckle_side_m", params_.speckle_side, Range::between(0.0, 1000.0),
        "[ours] so are those that cover less than a square of this side where they are; 0 = "
        "off");
    table.number("speckle_range_px", params_.speckle_range, Range::positive(),
                 "neighbours whose disparities differ more are not connected");
    table.number("min_texture", params_.min_texture, Range::between(0.0, 255.0),
                 "[ours] where neighbours differ by less gray values on average, there is no "
                 "disparity; 0 = off");
    table.number("min_agreement", params_.min_agreement, Range::between(0.0, 1.0),
                 "[ours] least correlation of the gradients of both images around a pixel, which "
                 "noise does not have; half of it among pixels that have it; 0 = off");
    table.integer("texture_window_px", params_.texture_window, Range::between(3, 255),
                  "[ours] side of the windows of both, odd");
    table.flag("refine", params_.refine,
               "[ours] least squares on gray values against the pull to whole disparities");
    table.integer("refine_window_px", params_.refine_window, Range::between(3, 31),
                  "[ours] side of its window, odd");
    table.number("min_brightness", min_brightness_, Range::between(0.0, 255.0),
                 "[ours] mean gray value of a frame that can be used");
    table.number("min_density", min_density_, Range::between(0.0, 1.0),
                 "[ours] fraction of the pixels of a usable frame that have a disparity");
    table.basic({"disparities_px", "paths", "uniqueness_percent", "speckle_side_m", "min_texture"});
  }
  void applyProfile(Profile profile) override {
    if (profile == Profile::Paper) params_.refine = false;
  }
  void configure(const RunSettings& settings) override {
    params_.threads = settings.threads;
    matcher_ = StereoMatcher(params_);
  }

  void process(Frame& frame) override {
    if (std::string problem = problemOf(frame.images); !problem.empty()) {
      frame.skip_reason = std::move(problem);
      return;
    }
    rectify(frame);
    checkRows(frame);
    const io::Calibration& calibration = *frame.images.calibration;
    StereoReport report;
    const DisparityImage disparity =
        matcher_.match(frame.images.left, frame.images.right, calibration, &report);
    frame.statistics.push_back({"stereo_density", report.density});
    frame.statistics.push_back({"disparity_min_px", static_cast<double>(report.min_disparity)});
    frame.statistics.push_back({"disparities_px", static_cast<double>(report.disparities)});
    frame.statistics.push_back({"stereo_matching.range_ms", report.range_ms});
    frame.statistics.push_back({"stereo_matching.match_ms", report.match_ms});
    frame.statistics.push_back({"stereo_matching.refine_ms", report.refine_ms});
    frame.skip_reason = problemOf(report, min_brightness_, min_density_);
    if (!frame.skip_reason.empty()) return;
    frame.even =
        evenTiles(io::toGray(frame.images.left).pixels.data(), disparity.width, disparity.height);

    std::vector<float> xyz;
    triangulate(disparity, calibration, xyz);
    frame.cloud = cloudOf(xyz, static_cast<std::uint32_t>(disparity.width),
                          static_cast<std::uint32_t>(disparity.height));
    frame.camera = calibration.camera;
    frame.baseline = calibration.baseline;
  }

 private:
  /// Later stages see a rectified pair only. A given pose is that of the left camera as it is; the
  /// rectified one is turned about its centre.
  void rectify(Frame& frame) {
    FrameImages& images = frame.images;
    if (!images.calibration->unrectified) return;
    if (!rectifier_) rectifier_.emplace(*images.calibration);
    images.left = rectifier_->rectifyLeft(images.left);
    images.right = rectifier_->rectifyRight(images.right);
    images.calibration = rectifier_->calibration();
    if (!frame.given_pose) return;
    frame.given_pose->linear() = frame.given_pose->linear() * rectifier_->rotation().transpose();
    frame.T_world_sensor = *frame.given_pose;
  }

  /// Matching along rows finds little where they are not the same, and part of that is wrong.
  void checkRows(Frame& frame) {
    constexpr double kMaxApart = 1.0;  // pixels
    if (unchecked_rows_ == 0) return;
    --unchecked_rows_;
    const std::optional<double> rows =
        rowsApart(frame.images.left, frame.images.right, *frame.images.calibration);
    if (!rows) return;
    unchecked_rows_ = 0;
    if (*rows <= kMaxApart) return;
    frame.warnings.push_back(
        "frame " + std::to_string(frame.number) + " " + frame.source +
        ": the pair is not rectified, or by another calibration: what both images show is " +
        detail::rounded(*rows, 1) +
        " rows apart; disparities will be few and part of them wrong. Rectify the images, or give "
        "the calibration of the unrectified pair");
  }

  StereoMatcherParams params_;
  double min_brightness_ = 4.0;
  double min_density_ = 0.02;
  StereoMatcher matcher_;
  std::optional<Rectifier> rectifier_;
  int unchecked_rows_ = 5;  ///< frames left in which to check that rows are aligned
};
}  // namespace

void detail::addStereoMatching(StageTable& table) {
  table.add<StereoMatchingStage>();
}

}  // namespace planar_mapping
