// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <malloc.h>

#include <exception>
#include <iostream>
#include <map>
#include <new>
#include <string>
#include <vector>

#include "commands.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/output.h"
#include "unknown_words.h"

namespace planar_mapping::tools {
namespace {

int report(const std::string& sentence, int exit_code) {
  std::cerr << "planar_map: " << sentence << '\n';
  return exit_code;
}

/// Every frame needs the same large buffers: fetched from the system anew, their pages would cost
/// more than a stage. Larger ones still go back at once.
void keepFrameBuffers() {
  constexpr int kLargestKept = 32 << 20;
  ::mallopt(M_MMAP_THRESHOLD, kLargestKept);
  ::mallopt(M_TRIM_THRESHOLD, 4 * kLargestKept);
}

/// What --help of a command ends with.
void addExamples(CLI::App& app) {
  static const std::map<std::string, std::vector<std::string>> kExamples = {
      {"run",
       {"run cloud.pcd -o out", "run kitti/sequences/00 -o out",
        "run rgbd_indoor.yaml -i sequence -o out --set pass_through.max_m=4",
        "run --watch recording -o out --idle 10"}},
      {"frontend", {"frontend -i sequence --connect mapper.local:5600 --keys frontend.key"}},
      {"keys", {"keys -o keys --name robot1"}},
      {"validate", {"validate my.yaml"}},
      {"config",
       {"config --explain multi_plane_segmentation.distance_threshold_m",
        "config --effective my.yaml"}},
      {"stages", {"stages", "stages --describe stereo_matching"}},
      {"info", {"info out/map.pmap", "info kitti/sequences/00 --json"}},
      {"query",
       {"query out/map.pmap --point 1,0,0.5 --ray 0,0,0.4,1,0,0",
        "query out/map.pmap --points cloud.pcd"}},
      {"convert",
       {"convert out/map.pmap map.ply", "convert out/map.pmap map.html",
        "convert out/map.pmap map.pmap --finished"}},
      {"report", {"report out -o report.html"}},
      {"merge", {"merge monday.pmap tuesday.pmap -o both.pmap"}},
      {"atlas",
       {"atlas info building.atlas", "atlas solve building.atlas --without-loop 12",
        "atlas export building.atlas map.pmap", "atlas merge a.atlas b.atlas -o both.atlas"}},
      {"localize", {"localize building.atlas sequence --frames 7"}},
      {"compare", {"compare out/map.pmap other/map.pmap --threshold 0.02"}},
      {"simulate", {"simulate corridor --write images --frames 12 --step 0.2 -o scene"}},
      {"evaluate", {"evaluate evaluate.yaml --cells 0.1,0.2 -o out"}}};
  app.footer("planar_map COMMAND --help has the options of a command, and examples.");
  for (CLI::App* command : app.get_subcommands({})) {
    const auto examples = kExamples.find(command->get_name());
    if (examples == kExamples.end()) continue;
    std::string text = "Examples:";
    for (const std::string& example : examples->second) text += "\n  planar_map " + example;
    const std::string own = command->get_footer();
    command->footer(own.empty() ? text : own + "\n\n" + text);
  }
}

int run(int argc, char** argv) {
  keepFrameBuffers();
  CLI::App app("Planar surface-based 3D maps from point clouds");
  app.name("planar_map");
  app.set_version_flag("--version", std::string("planar_map ") + PLANAR_MAPPING_VERSION);
  app.require_subcommand(0, 1);
  app.failure_message(CLI::FailureMessage::simple);
  int exit_code = kDone;
  for (AddCommand* add :
       {addRunCommand, addFrontendCommand, addKeysCommand, addValidateCommand, addConfigCommand,
        addStagesCommand, addInfoCommand, addQueryCommand, addConvertCommand, addReportCommand,
        addMergeCommand, addCompareCommand, addViewCommand, addSnapshotCommand, addSimulateCommand,
        addEvaluateCommand}) {
    add(app, exit_code);
  }
#if PLANAR_MAPPING_HAS_ATLAS
  addAtlasCommand(app, exit_code);
  addLocalizeCommand(app, exit_code);
#endif
  addExamples(app);
  if (argc < 2) {
    std::cerr << app.help();
    return kUsage;
  }
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // --help, --version
      app.exit(error);
      return kDone;
    }
    const bool unknown = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
    const std::string suggestion = unknown ? suggestionFor(app) : "";
    const CLI::App* command = app.get_subcommands().empty() ? &app : app.get_subcommands().front();
    const std::string name = command == &app ? "" : command->get_name() + " ";
    return report(
        error.what() + (suggestion.empty() ? "; see planar_map " + name + "--help" : suggestion),
        kUsage);
  }
}

}  // namespace
}  // namespace planar_mapping::tools

int main(int argc, char** argv) {
  using namespace planar_mapping;
  using namespace planar_mapping::tools;
  try {
    const int exit_code = run(argc, argv);
    std::cout.flush();
    if (std::cout) return exit_code;
    return report("the answer cannot be written to standard output: is the disk full?",
                  kInternalFailure);
  } catch (const UsageError& error) {
    return report(error.what(), kUsage);
  } catch (const ConfigError& error) {
    for (const std::string& problem : error.problems()) std::cerr << problem << '\n';
    return kBadConfiguration;
  } catch (const ParameterError& error) {
    return report(error.what(), kBadConfiguration);
  } catch (const OutputError& error) {
    return report(error.what(), kInternalFailure);
  } catch (const WriteError& error) {
    return report(error.what(), kInternalFailure);
  } catch (const RenderError& error) {
    return report(error.what(), kNoRenderer);
  } catch (const Error& error) {
    return report(error.what(), kInputUnreadable);
  } catch (const std::bad_alloc&) {
    return report("out of memory: use a smaller cloud, a voxel_grid stage, or more memory",
                  kInternalFailure);
  } catch (const std::exception& error) {
    return report(std::string("internal failure: ") + error.what(), kInternalFailure);
  }
}
