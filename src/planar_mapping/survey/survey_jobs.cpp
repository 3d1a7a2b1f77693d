// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/survey/survey_jobs.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/pipeline/output.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;
using detail::writingResult;

constexpr const char* kPlanName = "plan.json";

}  // namespace

SurveyJobs::SurveyJobs(const std::string& plan, const std::string& path, std::string folder)
    : folder_(std::move(folder)), plan_(parseSurveyPlan(plan, path)) {
  const std::string own = pathOf(kPlanName);
  std::error_code error;
  if (fs::exists(own, error) && io::readWholeText(own) != plan)
    throw InputError(folder_ + ": has results of another plan; give another folder, or remove it");
  writingResult([&]() {
    fs::create_directories(folder_, error);
    if (error) throw IoError(folder_, "cannot be created: " + error.message());
    if (!fs::exists(own, error)) io::writeFileAtomically(own, plan, io::Overwrite::Allow);
  });
}

SurveyJobs::SurveyJobs(std::string folder) : folder_(std::move(folder)) {
  const std::string own = pathOf(kPlanName);
  std::error_code ignored;
  if (!fs::exists(own, ignored))
    throw InputError(folder_ +
                     ": is a directory without plan.json, or none: no folder of a survey");
  plan_ = parseSurveyPlan(io::readWholeText(own), own);
}

std::string SurveyJobs::pathOf(const std::string& name) const {
  return (fs::path(folder_) / name).string();
}

/// \param end  "atlas" or "json"
std::string SurveyJobs::pieceOf(std::size_t piece, const char* end) const {
  return pathOf("piece_" + std::to_string(piece) + "." + end);
}

/// A record. \throws InputError if its job was not done
std::string SurveyJobs::requireDone(const std::string& name, const char* job) const {
  std::error_code ignored;
  if (!fs::exists(pathOf(name), ignored))
    throw InputError(folder_ + ": has no " + name + ": planar_map atlas " + job + " comes first");
  return pathOf(name);
}

/// Whether a piece has been mapped. \throws InputError if it has not, and may not be left out
bool SurveyJobs::hasPiece(std::size_t piece, bool allow_missing) const {
  std::error_code ignored;
  if (fs::exists(pieceOf(piece, "json"), ignored)) return true;
  if (allow_missing) return false;
  throw InputError(folder_ + ": " + plan_.nameOf(piece) +
                   " has not been mapped: planar_map atlas submap; --allow-missing leaves it out");
}

}  // namespace planar_mapping
