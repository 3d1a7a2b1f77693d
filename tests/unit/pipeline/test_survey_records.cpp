// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "planar_mapping/survey/survey_records.h"

namespace planar_mapping {
namespace {

TEST(SurveyRecords, ALinkKeepsItsKindAndItsDoubt) {
  Link link;
  link.from_submap = 3;
  link.to_submap = 1;
  link.from_keyframe = 7;
  link.to_keyframe = 2;
  link.evidence.seen_through = 0.05;
  for (const LinkKind kind : {LinkKind::Loop, LinkKind::Surface}) {
    link.kind = kind;
    const Link read = detail::linkOf(detail::toJson(link));
    EXPECT_EQ(kind, read.kind);
    EXPECT_EQ(kind == LinkKind::Surface, read.isDoubt());
    EXPECT_EQ(7, read.from_keyframe);
    EXPECT_EQ(1, read.to_submap);
  }
}

}  // namespace
}  // namespace planar_mapping
