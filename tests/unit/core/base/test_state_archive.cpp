// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/base/detail/state_archive.h"

#include <gtest/gtest.h>

#include "planar_mapping/core/base/types.h"

namespace planar_mapping::detail {
namespace {

struct Everything {
  int number = 0;
  Pose pose = Pose::Identity();
  std::string text;
  std::optional<Vector3> place;
  std::vector<std::pair<std::int64_t, double>> pairs;
  std::map<int, std::string> names;
  std::unordered_map<std::int64_t, float> values;
  std::deque<std::vector<Matrix3>> matrices;

  template <typename Archive>
  void visitState(Archive& archive) {
    archive(number, pose, text, place, pairs, names, values, matrices);
  }
};

Everything example() {
  Everything e;
  e.number = -3;
  e.pose.translation() = Vector3(1.0, 2.0, 1e-300);
  e.text = std::string("line\n\0end", 9);
  e.place = Vector3(0.1, 0.2, 0.3);
  e.pairs = {{7, 0.1}, {-8, 1e300}};
  e.names = {{1, "one"}, {2, ""}};
  e.values = {{5, 0.5f}, {6, 0.25f}};
  e.matrices = {{Matrix3::Identity(), 2.0 * Matrix3::Identity()}, {}};
  return e;
}

TEST(StateArchive, BringsBackEveryKindOfMember) {
  const Everything before = example();
  Everything after;
  after.names = {{9, "is forgotten"}};
  restoreState(after, stateOf(before));
  EXPECT_EQ(before.number, after.number);
  EXPECT_EQ(before.pose.matrix(), after.pose.matrix());
  EXPECT_EQ(before.text, after.text);
  EXPECT_EQ(before.place, after.place);
  EXPECT_EQ(before.pairs, after.pairs);
  EXPECT_EQ(before.names, after.names);
  EXPECT_EQ(before.values, after.values);
  ASSERT_EQ(2u, after.matrices.size());
  EXPECT_EQ(before.matrices[0][1], after.matrices[0][1]);
}

TEST(StateArchive, RefusesEveryCutAndWhatIsTooLong) {
  const std::string bytes = stateOf(example());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    Everything e;
    EXPECT_THROW(restoreState(e, bytes.substr(0, size)), Error) << size;
  }
  Everything e;
  EXPECT_THROW(restoreState(e, bytes + "x"), Error);
}

TEST(StateArchive, HugeCountsTakeNoMemory) {
  std::vector<double> numbers;
  const std::string bytes = stateOf(std::uint64_t{1} << 60);
  EXPECT_THROW(restoreState(numbers, bytes), Error);
  std::vector<std::string> texts;
  EXPECT_THROW(restoreState(texts, bytes), Error);
}

}  // namespace
}  // namespace planar_mapping::detail
