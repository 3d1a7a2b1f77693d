// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include "builtin.h"
#include "motion/motion_finder.h"

namespace planar_mapping {
namespace {

class MotionEstimationStage : public Stage {
 public:
  static constexpr const char* kName = "motion_estimation";
  static constexpr const char* kSummary =
      "finds the pose of the frame from its key features (the paper, Eq. 8) or takes a given one";
  static constexpr StageKind kKind = StageKind::Motion;

  void declare(ParameterTable& table) override { finder_.keys.declare(table); }
  void configure(const RunSettings& settings) override { finder_.keys.configure(settings.seed); }
  void adapt(const CloudScale& scale) override {
    finder_.keys.noise.adapt(scale);
    finder_.setOptical(scale.optical);
  }
  void process(Frame& frame) override { finder_.place(frame); }
  std::string saveState() const override { return finder_.saveState(); }
  void loadState(const std::string& bytes) override { finder_.loadState(bytes); }

 private:
  detail::MotionFinder finder_;
};

}  // namespace

void detail::addMotionEstimation(StageTable& table) {
  table.add<MotionEstimationStage>();
}

}  // namespace planar_mapping
