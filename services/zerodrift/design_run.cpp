// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/design_run.h"

#include <algorithm>
#include <stdexcept>

#include "common/config/chamber_limits_config.h"
#include "common/config/twin_config.h"
#include "services/zerodrift/design_findings.h"
#include "services/zerodrift/progress_bar.h"

namespace zerodrift::services {
namespace {

FixedExperiment best_fixed(const DesignRequest& request, const twin::ChamberLimits& limits,
                           DesignResult& result) {
  FixedExperiment best{result.design.best_of_menu, result.design.menu_profile,
                       result.design.of_menu};
  for (const std::string& file : request.against) {
    const twin::Profile profile = config::load_profile(file);
    if (const auto excess = twin::find_excess(profile, limits)) {
      result.notes.push_back(file + ": exceeds the limits and is not compared with: " + *excess);
      continue;
    }
    auto judgement = diagnosis::judge_profile(result.questions, profile);
    if (judgement.entropy_nats < best.judgement.entropy_nats)
      best = {file, profile, std::move(judgement)};
  }
  return best;
}

// The bound of standard errors is a low one: what simulated records tell apart isn't inseparable.
void drop_told_apart(DesignResult& result) {
  const auto is_told = [&](core::Axis axis, const std::string& explanation) {
    return std::any_of(result.shares.begin(), result.shares.end(), [&](const auto& share) {
      return share.axis == axis && share.explanation == explanation &&
             2 * share.resolved > share.records;
    });
  };
  std::erase_if(result.design.inseparable, [&](const diagnosis::Inseparable& one) {
    const core::Axis axis = result.questions[one.pair.question].axis;
    return is_told(axis, one.pair.first) && is_told(axis, one.pair.second);
  });
}

}  // namespace

DesignResult run_design(const DesignRequest& request) {
  auto loaded = config::load_model(request.model);
  const twin::ChamberLimits limits = config::load_chamber_limits(request.limits);
  DesignResult result;
  OpenFindings findings = read_findings(request.diagnosis, loaded.model);
  result.notes = std::move(loaded.warnings);
  result.notes.insert(result.notes.end(), findings.notes.begin(), findings.notes.end());
  result.questions = std::move(findings.questions);
  if (result.questions.empty()) return result;
  try {
    ProgressBars bars;
    const auto bar = [&](const char* what) {
      return [&bars, what](double share) { bars(what, share); };
    };
    result.design =
        diagnosis::design(result.questions, limits, {.seed = request.seed}, bar("designing"));
    result.design.profile.name = "designed";
    result.fixed = best_fixed(request, limits, result);
    result.shares =
        diagnosis::measured_shares(result.questions, result.design.profile, request.replicates,
                                   request.seed, bar("trying what was designed"));
    drop_told_apart(result);
    result.fixed_shares =
        diagnosis::measured_shares(result.questions, result.fixed.profile, request.replicates,
                                   request.seed, bar("trying the best fixed one"));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(request.model + ": " + error.what());
  }
  return result;
}

}  // namespace zerodrift::services
