// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/stage_table.h"

#include "planar_mapping/base/error.h"

namespace planar_mapping {

void StageTable::add(StageEntry entry) {
  constexpr const char* kAllowed = "abcdefghijklmnopqrstuvwxyz0123456789_";
  if (entry.name.empty() || entry.name.find_first_not_of(kAllowed) != std::string::npos)
    throw InputError("stage name '" + entry.name + "' is not snake_case");
  if (find(entry.name) != nullptr)
    throw InputError("there is a stage '" + entry.name + "' already; give yours another name");
  entries_.push_back(std::move(entry));
}

const StageEntry* StageTable::find(const std::string& name) const {
  for (const StageEntry& entry : entries_) {
    if (entry.name == name) return &entry;
  }
  return nullptr;
}

void StageTable::addMissing(const std::string& name, const std::string& option) {
  missing_.emplace_back(name, option);
}

std::string StageTable::missingOption(const std::string& name) const {
  for (const auto& entry : missing_) {
    if (entry.first == name) return entry.second;
  }
  return "";
}

Stage::~Stage() = default;

}  // namespace planar_mapping
