// SPDX-License-Identifier: Apache-2.0
// What every way of predicting drift has in common, so that they can be compared like with like:
// it learns labelled means in the order of time and predicts the drift of a later instant from that
// instant's features. Nothing else reaches it, so no scheme can see ahead.
#pragma once

#include <span>

namespace zerodrift::regression {

// A label: the mean drift over some seconds at rest or against a reference. Targets and variances
// in any one unit (the caller's) and its square; features dimensionless, scaled to the order of 1.
struct DriftLabel {
  double time_s = 0.0;               // end of the mean; strictly increasing from label to label
  double duration_s = 0.0;           // of the mean, > 0
  std::span<const double> features;  // means over the label; valid during the call only
  double drift = 0.0;
  double variance = 0.0;  // of the label as a measurement, > 0
};

struct DriftPrediction {
  double drift = 0.0;
  // Of drift as an estimate of the true drift's mean over a label, the label's own noise not
  // included; negative: the scheme does not know.
  double variance = -1.0;
  // The service sends this very variance out with its samples, so it is judged as it is. What a
  // scheme for comparison states is calibrated on its past errors first (interval_calibrator.h).
  bool is_sent_out = false;
};

class DriftScheme {
 public:
  virtual ~DriftScheme() = default;

  // The features of an instant, in the order of time, before it is predicted and whether or not its
  // label is ever learned: what a scheme with thermal memory keeps up with. They are valid during
  // the call only.
  virtual void observe(double /*time_s*/, std::span<const double> /*features*/) {}

  // A label of an instant that was observed.
  virtual void learn(const DriftLabel& label) = 0;

  // The label measured at `time_s` >= the newest learned label's time, from its features. A scheme
  // that knows nothing yet predicts 0 with unknown variance.
  [[nodiscard]] virtual DriftPrediction predict(double time_s,
                                                std::span<const double> features) const = 0;
};

}  // namespace zerodrift::regression
