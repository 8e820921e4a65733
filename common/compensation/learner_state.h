// SPDX-License-Identifier: Apache-2.0
// All that a learner knows, as plain values: what a checkpoint holds. A learner made from it
// continues to the bit. What follows from the options alone is not in it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/compensation/drift_forecast.h"
#include "common/compensation/learner.h"
#include "common/core/axis.h"
#include "common/regression/online_svr.h"
#include "common/regression/sample_domain.h"
#include "common/regression/svr_predictor.h"

namespace zerodrift::compensation {

// A DriftModel; the fields are its own.
struct DriftModelState {
  core::SensorTime time{core::kNever};
  double held_radps = 0.0;
  std::optional<double> held_slope_radps2{};
  double held_variance = 0.0;
  double predicted_held_radps = 0.0;
  bool trained = false;
  double offset_radps = 0.0;
  double scale_radps = 1.0;
};

// A model kept back, with what the SVR was then.
struct KeptModelState {
  DriftModelState drift{};
  regression::SvrPredictorState predictor{};
  std::vector<double> domain{};  // SampleDomain::export_samples()
};

struct HorizonState {
  std::optional<KeptModelState> judged{};
  std::optional<KeptModelState> waiting{};
  ForecastJudge::Experience learned{};
  ForecastJudge::Experience beyond{};
  double moved_square = 0.0;
  double moved_weight = 0.0;
  double aged = 0.0;
  core::SensorTime last_judged{core::kNever};
};

struct ForecastJudgeState {
  std::array<HorizonState, kHorizons> horizons{};
  TrustTable table{};
};

struct HeldLabelState {
  AxisLabel label{};
  std::optional<std::size_t> slot{};  // where the SVR kept it, as the sample of that arrival
  std::uint64_t arrival = 0;
};

struct AxisLearnerState {
  std::vector<AxisLabel> initial{};            // empty once the initial set is complete
  regression::OnlineSvrOptions svr_options{};  // in force: kernel, tube and box as chosen last
  regression::OnlineSvrState svr{};
  std::uint64_t labels = 0;
  std::uint64_t next_selection = 0;
  std::vector<HeldLabelState> minute{};
  DriftModelState model{};  // its predictor and domain are the SVR's
  ForecastJudgeState judge{};
};

struct LearnerState {
  core::PerAxis<AxisLearnerState> axes{};
  std::uint64_t epoch = 0;
  std::uint64_t labels = 0;

  // End of the newest label of any axis; kNever without one.
  [[nodiscard]] core::SensorTime newest_label() const noexcept;
};

}  // namespace zerodrift::compensation
