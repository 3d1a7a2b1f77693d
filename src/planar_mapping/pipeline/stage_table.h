// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/pipeline/stage.h"

namespace planar_mapping {

/// A stage as the table knows it.
struct StageEntry {
  std::string name;
  std::string summary;
  StageKind kind = StageKind::Any;
  std::function<std::unique_ptr<Stage>()> make;
};

/// The stages there are. Stages are added explicitly: registerBuiltinStages() for ours, add<>() for
/// a caller's own, loadPlugin() for those in a shared library.
class PLANAR_MAPPING_EXPORT StageTable {
 public:
  template <typename StageType>
  void add() {
    add({StageType::kName, StageType::kSummary, StageType::kKind,
         []() -> std::unique_ptr<Stage> { return std::make_unique<StageType>(); }});
  }
  /// \throws InputError if the name is empty, not snake_case or already taken
  void add(StageEntry entry);

  /// Names a stage that this build lacks, and the build option that would make it.
  void addMissing(const std::string& name, const std::string& option);

  const std::vector<StageEntry>& entries() const { return entries_; }
  /// Null if there is none of that name.
  const StageEntry* find(const std::string& name) const;
  /// The build option of a stage that this build lacks; empty for any other name.
  std::string missingOption(const std::string& name) const;

 private:
  std::vector<StageEntry> entries_;
  std::vector<std::pair<std::string, std::string>> missing_;  ///< name and option
};

/// Our PCL classes and the PCL filters people chain before them.
PLANAR_MAPPING_EXPORT void registerBuiltinStages(StageTable& table);

}  // namespace planar_mapping
