// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iostream>
#include <memory>

#include "commands.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/plugin.h"

namespace planar_mapping::tools {
namespace {

/// A stage with its parameters at the defaults of a profile.
struct Declared {
  std::unique_ptr<Stage> stage;
  ParameterTable parameters;
};

Declared declare(const StageEntry& entry, Profile profile) {
  Declared declared;
  declared.stage = entry.make();
  declared.stage->applyProfile(profile);
  declared.stage->declare(declared.parameters);
  return declared;
}

std::string withUnit(const std::string& value, const Parameter& parameter) {
  const bool has_unit = !parameter.unit().empty() && value != "auto";
  return has_unit ? value + " " + parameter.unit() : value;
}

/// "0.05 m", or "multi_ransac with profile paper, else automatic".
std::string defaultText(const StageEntry& entry, const Parameter& compact) {
  const Declared paper = declare(entry, Profile::Paper);
  const std::string usual = withUnit(toYaml(compact.get()), compact);
  const std::string in_paper =
      withUnit(toYaml(paper.parameters.find(compact.name)->get()), compact);
  return usual == in_paper ? usual : usual + " (profile paper: " + in_paper + ")";
}

/// The basic or the advanced parameters of a stage as lines of a table.
std::string rows(const StageEntry& entry, bool basic) {
  std::string lines;
  const Declared declared = declare(entry, Profile::Compact);
  for (const Parameter& parameter : declared.parameters.parameters()) {
    if (parameter.basic != basic) continue;
    lines += "| `" + parameter.name + "` | " + defaultText(entry, parameter) + " | " +
             parameter.allowed() + " | " + parameter.meaning + " |\n";
  }
  return lines;
}

/// Name, meaning, allowed values and default.
std::string describe(const StageEntry& entry, const Parameter& parameter) {
  return parameter.name + "\n    " + parameter.meaning + "\n    allowed: " + parameter.allowed() +
         "\n    default: " + defaultText(entry, parameter) + "\n";
}

/// Name, summary and one block per parameter.
std::string describeStage(const StageEntry& entry) {
  std::string text = entry.name + ": " + entry.summary + "\n";
  const Declared declared = declare(entry, Profile::Compact);
  for (const Parameter& parameter : declared.parameters.parameters())
    text += "\n  " + describe(entry, parameter);
  return text;
}

/// A whole configuration with every stage, each key with its comment.
std::string defaultsYaml(const StageTable& table, Profile profile) {
  std::string yaml =
      R"(# Every key with its default. A chain has the stages it needs, in this order.
version: 1            # of this format
profile: )" +
      std::string(profile == Profile::Paper ? "paper" : "compact") +
      R"(      # paper (nothing beyond the paper) or compact
seed: 12345           # of everything random, 0 to 9007199254740991
threads: 0            # 0 = all cores; never changes the result
frames: "0::1"        # first:last:step
up: auto              # x, y, z, -x, -y, -z: the vertical of the world for all stages
# inputs: [cloud.pcd] # files or folders, relative to this file
# poses: poses.txt    # trajectory in TUM or KITTI format
# calibration: calib.yaml  # in place of that of the input
# plugins: [libmy_stage.so]
stages:
)";
  for (const StageEntry& entry : table.entries()) {
    const Declared declared = declare(entry, profile);
    yaml += "  # " + entry.summary + "\n  - stage: " + entry.name + "\n";
    for (const Parameter& parameter : declared.parameters.parameters()) {
      std::string line = "    " + parameter.name + ": " + toYaml(parameter.get());
      line.resize(std::max<std::size_t>(line.size() + 2, 42), ' ');
      yaml += line + "# " + parameter.meaning + "; " + parameter.allowed() + "\n";
    }
  }
  return yaml;
}

/// Keys beside the stages, and what they mean.
constexpr std::pair<const char*, const char*> kTopKeys[] = {
    {"version", "of this format: 1; required"},
    {"profile", "`compact` (default) or `paper`: nothing beyond the paper"},
    {"seed", "of everything random, 0 to 9007199254740991, default 12345"},
    {"threads", "0 = all cores, the default; never changes the result"},
    {"scale", "metres a unit of the clouds of files, 0.001 for millimetres, default 1"},
    {"sensor_origin_m",
     "[x, y, z] where the sensor stood, if the clouds are in the coordinates of the world; `auto` "
     "(default) = they are in those of the sensor"},
    {"up",
     "vertical of the world for all stages, whatever theirs says: `x`, `y`, `z`, `-x`, `-y`, `-z`; "
     "`auto` (default) = theirs"},
    {"inputs", "files or folders, relative to the configuration file"},
    {"poses", "trajectory in TUM or KITTI format, relative to the configuration file"},
    {"calibration",
     "a calib.yaml in place of that of the input, relative to the configuration file"},
    {"frames", "`\"first:last:step\"`, default all"},
    {"plugins",
     "shared libraries with stages: absolute paths, or names of files beside the configuration "
     "file; `run` alone loads them"},
    {"stages", "what is done with each frame, in order; required"},
};

/// docs/parameters.md.
std::string referencePage(const StageTable& table) {
  std::string page = R"(# Parameters

Generated by `planar_map stages --markdown`; a test keeps it up to date. A key carries its
unit as suffix (`_m`, `_deg`, `_s`, `_px`); without one it has none. Choices that the paper
does not make are marked [ours]. Start with the keys above *Advanced*; [tuning](tuning.md) says what they do.

## The file

| key | meaning |
|---|---|
)";
  for (const auto& [key, meaning] : kTopKeys)
    page += std::string("| `") + key + "` | " + meaning + " |\n";
  page += R"(
Every stage has the key `enabled` (true or false, default true) beside its own: `false` leaves it out.

## Profile `paper`

Planes come from 1000 sampled features by multi-RANSAC at a fixed d_T, cells are not filled,
absorbed or merged beyond III-F, dr of Eq. 4 has no floor (`range_floor_cells: 0`), looking through
a cell changes nothing and the newest belief counts alone. A value that the file writes out wins over
the profile. What the paper leaves open cannot be switched off and keeps its [ours] value:
`single_feature_probability` (Eq. 4 has no spread for one feature), `features_per_cell` (a cloud has
no detector), the bound that keeps p and q of Eq. 5 off 0 and 1, `min_probability` (below which belief
a cell goes), `association_*` and `refit_tolerance_cells` (which planes of two frames are one),
`patch_gap_m`, `significance`, `max_range_m`, `range_image_step_deg`, and all of `ground_removal`.

## What `auto` becomes

From the first frame that is mapped [ours]: the *extent* is the diagonal of the box that holds the
middle 98 % of the points along each axis, the *spacing* the side of the square of surface that a point
stands for (the points in a cell of a 64th of the largest side share it), half of the points for less,
the *noise* the RMS distance of neighbouring points from their plane. The automatic resolution is the
`resolution_m` of `planar_cuboid_approximation` where that is given, else extent / 100 or three
spacings, the larger, at most 0.2 m, but at least two (of more than 1 m three) and four times the
noise, rounded to 1, 2 or 5 times a power of ten; it has the unit of the file, so clouds in millimetres work too. The other keys say what they take from it.
`config.resolved.yaml` of a run holds the values that were used.

## Stages
)";
  for (const StageEntry& entry : table.entries()) {
    page += "\n### " + entry.name + "\n\n" + entry.summary + "\n";
    const std::string basic = rows(entry, true);
    const std::string advanced = rows(entry, false);
    const std::string head = "\n| key | default | allowed | meaning |\n|---|---|---|---|\n";
    if (!basic.empty()) page += head + basic + "\nAdvanced:\n";
    page += head + advanced;
  }
  return page;
}

/// \p key is "stage.key", or a key that may occur in several stages.
std::string explain(const StageTable& table, const std::string& key) {
  std::string text;
  for (const auto& [name, meaning] : kTopKeys)
    if (key == name) text = key + "\n    " + meaning + "\n";
  const std::size_t dot = key.find('.');
  const std::string stage = dot == std::string::npos ? "" : key.substr(0, dot);
  const std::string name = dot == std::string::npos ? key : key.substr(dot + 1);
  for (const StageEntry& entry : table.entries()) {
    if (!stage.empty() && entry.name != stage) continue;
    const Declared declared = declare(entry, Profile::Compact);
    if (const Parameter* parameter = declared.parameters.find(name))
      text += entry.name + "." + describe(entry, *parameter);
  }
  if (text.empty())
    throw UsageError("no stage has a key '" + key + "'; planar_map config --defaults shows all");
  return text;
}

/// Nothing is executed: without its plugins a file cannot be resolved.
std::string effective(const std::string& path, StageTable& table,
                      const ConfigurationOverrides& overrides) {
  const Configuration configuration = loadConfiguration(path, table, overrides, Plugins::Ignore);
  if (configuration.unknown_stages.empty()) return effectiveYaml(configuration);
  throw ConfigError({path + ":1:1: stage '" + configuration.unknown_stages.front() +
                     "' is of a plugin, which run alone loads; config.resolved.yaml of a run has "
                     "all values"});
}

void printList(const StageTable& table) {
  std::size_t width = 0;
  for (const StageEntry& entry : table.entries()) width = std::max(width, entry.name.size());
  for (const StageEntry& entry : table.entries())
    std::cout << entry.name << std::string(width + 2 - entry.name.size(), ' ') << entry.summary
              << '\n';
}

}  // namespace

void addConfigCommand(CLI::App& app, int&) {
  struct Arguments {
    bool defaults = false;
    std::string explain;
    std::string effective;
    ConfigurationOverrides overrides;
    std::string profile;
  };
  auto* command =
      app.add_subcommand("config", "All keys with unit, range, default, meaning; resolved files");
  const auto arguments = std::make_shared<Arguments>();
  auto* what = command->add_option_group("what");
  what->add_flag("--defaults", arguments->defaults, "Every stage with every key");
  what->add_option("--explain", arguments->explain, "A key: KEY or STAGE.KEY");
  what->add_option("--effective", arguments->effective, "A file with every value written out");
  what->require_option(1);
  command->add_option("--set", arguments->overrides.assignments, "stage.key=value, repeatable")
      ->allow_extra_args(false);
  command->add_option("--profile", arguments->profile, "paper or compact")
      ->check(CLI::IsMember({"paper", "compact"}));
  command->callback([arguments]() {
    StageTable table;
    registerBuiltinStages(table);
    if (!arguments->profile.empty()) arguments->overrides.profile = arguments->profile;
    if (arguments->defaults) {
      std::cout << defaultsYaml(table,
                                arguments->profile == "paper" ? Profile::Paper : Profile::Compact);
    } else if (!arguments->explain.empty()) {
      std::cout << explain(table, arguments->explain);
    } else {
      std::cout << effective(arguments->effective, table, arguments->overrides);
    }
  });
}

void addValidateCommand(CLI::App& app, int&) {
  struct Arguments {
    std::string configuration;
    ConfigurationOverrides overrides;
    bool quiet = false;
  };
  auto* command =
      app.add_subcommand("validate", "Every problem of a configuration in one go; nothing is run");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("config", arguments->configuration, "Configuration file (*.yaml)")
      ->required();
  command->add_option("--set", arguments->overrides.assignments, "stage.key=value, repeatable")
      ->allow_extra_args(false);
  command->add_flag("-q,--quiet", arguments->quiet, "Say nothing but problems");
  command->callback([arguments]() {
    StageTable table;
    registerBuiltinStages(table);
    const Configuration configuration =
        loadConfiguration(arguments->configuration, table, arguments->overrides, Plugins::Ignore);
    for (const std::string& name : configuration.unknown_stages)
      std::cerr << arguments->configuration << ": stage '" << name
                << "' is not checked: plugins are loaded by run alone\n";
    if (!arguments->quiet) std::cout << arguments->configuration << ": no problems\n";
  });
}

void addStagesCommand(CLI::App& app, int&) {
  struct Arguments {
    std::string describe;
    std::vector<std::string> plugins;
    bool markdown = false;
  };
  auto* command = app.add_subcommand("stages", "The stages there are and their parameters");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("--describe", arguments->describe, "One stage with all its parameters");
  command->add_option("--plugin", arguments->plugins, "Shared library with more stages");
  command->add_flag("--markdown", arguments->markdown, "All of them as docs/parameters.md");
  command->callback([arguments]() {
    StageTable table;
    registerBuiltinStages(table);
    for (const std::string& plugin : arguments->plugins) loadPlugin(plugin, table);
    if (arguments->markdown) {
      std::cout << referencePage(table);
    } else if (arguments->describe.empty()) {
      printList(table);
    } else if (const StageEntry* entry = table.find(arguments->describe)) {
      std::cout << describeStage(*entry);
    } else {
      throw UsageError("there is no stage '" + arguments->describe +
                       "'; planar_map stages lists them");
    }
  });
}

}  // namespace planar_mapping::tools
