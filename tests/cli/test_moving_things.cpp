// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What has gone away is no longer in the map, what stays is.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli_fixture.h"

namespace planar_mapping {
namespace {

class MovingThings : public CliTest {
 protected:
  /// States of places in the map of a corridor with a person who leaves and a door that opens.
  std::vector<std::string> statesOf(const std::string& configuration, const std::string& written,
                                    const std::vector<std::string>& places) {
    const std::string input = directory_ / written;
    EXPECT_EQ(planarMap({"simulate", "corridor", "--write", written, "--frames", "40", "--moving",
                         "--seed", "31", "-o", input, "-q"})
                  .exit_code,
              0);
    const std::string output = directory_ / (written + "_map");
    expectExit(0, planarMap({"run", config(configuration), "-i", input, "-o", output, "-q"}));
    std::vector<std::string> query{"query", output + "/map.pmap", "--json"};
    for (const std::string& place : places) query.insert(query.end(), {"--point", place});
    const ProgramResult answer = expectExit(0, planarMap(query));
    std::vector<std::string> states;
    const auto json = nlohmann::json::parse(answer.out);
    for (const auto& point : json["point"]) states.push_back(point["state"].get<std::string>());
    return states;
  }
};

TEST_F(MovingThings, OfAStereoCameraAreForgottenWhereItSeesWhatIsBehind) {
  EXPECT_EQ(statesOf("stereo_indoor.yaml", "images",
                     {"4.2,0.35,1.1", "6.92,0.2,0.9", "6.92,-0.4,1.2", "5.1,1.02,1.2"}),
            (std::vector<std::string>{"free", "free", "free", "occupied"}));
}

TEST_F(MovingThings, OfCloudsAreForgottenLikewise) {
  EXPECT_EQ(statesOf("pcd_sequence.yaml", "clouds",
                     {"4.3,0.35,1.1", "6.92,0.2,0.9", "6.92,-0.4,1.2", "5.1,1.02,1.2"}),
            (std::vector<std::string>{"free", "free", "free", "occupied"}));
}

}  // namespace
}  // namespace planar_mapping
