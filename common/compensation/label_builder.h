// SPDX-License-Identifier: Apache-2.0
// From samples to labels: means at rest, confirmed by the stillness that follows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/compensation/rest_gate.h"
#include "common/core/ring_buffer.h"
#include "common/core/state_archive.h"
#include "common/experts/thermal_basis.h"
#include "common/thermal/features.h"

namespace zerodrift::compensation {

using FeatureArray = std::array<double, thermal::kMaxFeatures>;

// What the data path held for one axis while a block ran.
struct AxisContext {
  bool features_ready = false;
  FeatureArray features{};
  bool prior_ready = false;             // looked at with a prior only
  double prior_radps = 0.0;             // the prior's drift; 0 without one
  std::optional<double> applied_radps;  // the drift taken off, once there are labels
  std::optional<double> held_radps;     // the last stationary minute's

  void carry(core::StateArchive& archive) {
    archive(features_ready, features, prior_ready, prior_radps, applied_radps, held_radps);
  }
};

// Sums the samples of one DriftBlock. Cost: a few additions a sample.
class BlockAverager {
 public:
  explicit BlockAverager(double block_s) : block_(core::from_seconds(block_s)) {}

  // The block that this sample's time ends, if any; the sample itself then opens the next one.
  std::optional<DriftBlock> advance(core::SensorTime time, double interval_s) noexcept;
  // `reference_variance`: of what was taken off the rate, (rad/s)²; 0 where that is exact.
  void add(core::Axis axis, double drift_radps, double reference_variance = 0.0) noexcept;
  void mark_reference() noexcept { referenced_ = true; }
  void mark_turning() noexcept { turning_ = true; }
  [[nodiscard]] bool turning() const noexcept { return last_turning_; }
  void restart() noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(begin_, newest_, sums_, referenced_, turning_, last_turning_);
    archive.require(begin_ == core::kNever || newest_ != core::kNever);
  }

 private:
  struct Sums {
    std::size_t count = 0;
    double shift = 0.0;  // first value: variances of small differences keep their digits
    double sum = 0.0;    // of value - shift
    double square = 0.0;
    double reference_variance = 0.0;

    void carry(core::StateArchive& archive) {
      archive(count, shift, sum, square, reference_variance);
    }
  };
  [[nodiscard]] DriftBlock close(core::SensorTime end) noexcept;

  core::SensorTime block_;
  core::SensorTime begin_{core::kNever};
  core::SensorTime newest_{core::kNever};
  core::PerAxis<Sums> sums_{};
  bool referenced_ = false;
  bool turning_ = false;
  bool last_turning_ = false;
};

// A mean at rest or against a reference, and what was predicted for that time before it was known.
struct Label {
  core::SensorTime begin{0};
  core::SensorTime end{0};
  core::PerAxis<bool> valid{};
  core::PerAxis<double> drift_radps{};  // as measured
  core::PerAxis<double> prior_radps{};  // the prior's part of it; the learner learns the rest
  // Of the label as a measurement: the gyro's noise, and the reference's error, which is taken to
  // last for the whole label.
  core::PerAxis<double> variance_radps2{};
  core::PerAxis<bool> features_ready{};
  core::PerAxis<FeatureArray> features{};  // means over the label
  experts::ThermalState thermal{};         // mean over the label
  core::PerAxis<std::optional<double>> applied_radps{};
  core::PerAxis<std::optional<double>> held_radps{};

  void carry(core::StateArchive& archive) {
    archive(begin, end, valid, drift_radps, prior_radps, variance_radps2, features_ready, features,
            thermal, applied_radps, held_radps);
    archive.require(begin != core::kNever && end != core::kNever);
  }
};

// Collects still blocks into labels and gives a label out once `confirm_s` of further stillness
// shows that it ended before any motion began. Motion discards everything not yet confirmed.
class LabelBuilder {
 public:
  LabelBuilder(double label_s, double confirm_s);

  // At most one label is confirmed a block.
  std::optional<Label> add(const DriftBlock& block, const core::PerAxis<AxisContext>& context,
                           const experts::ThermalState& thermal,
                           const core::PerAxis<double>& block_variance_radps2) noexcept;
  void discard() noexcept;

  // How many stretches of stillness in turn were discarded before they gave a label.
  [[nodiscard]] std::size_t fruitless_stretches() const noexcept { return fruitless_; }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(begin_, end_, sums_, thermal_, blocks_, pending_, has_given_);
    archive.counts(fruitless_);
    archive.require(begin_ == core::kNever || blocks_ > 0);
    archive.require((begin_ == core::kNever) == (end_ == core::kNever));
  }

 private:
  struct Mean {
    std::size_t count = 0;
    double sum = 0.0;
    void add(double value) noexcept {
      sum += value;
      ++count;
    }
    [[nodiscard]] double value() const noexcept { return sum / static_cast<double>(count); }

    void carry(core::StateArchive& archive) {
      archive.counts(count);
      archive(sum);
    }
  };
  struct AxisSums {
    Mean drift;
    Mean prior;
    double variance = 0.0;            // sum of block variances
    double reference_variance = 0.0;  // sum over blocks
    Mean applied;
    Mean held;
    std::size_t ready = 0;
    FeatureArray features{};

    void carry(core::StateArchive& archive) {
      archive(drift, prior, variance, reference_variance, applied, held, ready, features);
    }
  };
  static constexpr std::size_t kPending = 64;

  void accumulate(const DriftBlock& block, const core::PerAxis<AxisContext>& context,
                  const experts::ThermalState& thermal,
                  const core::PerAxis<double>& block_variance_radps2) noexcept;
  void finish() noexcept;
  void reopen() noexcept;

  core::SensorTime label_;
  core::SensorTime confirm_;
  core::SensorTime begin_{core::kNever};
  core::SensorTime end_{core::kNever};
  core::PerAxis<AxisSums> sums_{};
  experts::ThermalState thermal_{};  // sums over blocks
  std::size_t blocks_ = 0;
  core::RingBuffer<Label> pending_{kPending};
  bool has_given_ = false;  // a label, since the last discard
  std::size_t fruitless_ = 0;
};

}  // namespace zerodrift::compensation
