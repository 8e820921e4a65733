// SPDX-License-Identifier: Apache-2.0
// The pipeline of the compensator itself, with a learner that gets to work when it is notified and
// at no other time, as its thread does.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/service/gyro_pipeline.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::service {
namespace {

using compensation::Compensator;
using compensation::testing::Record;

class NotifiedLearner final : GyroPipeline<Compensator>::Port {
 public:
  explicit NotifiedLearner(const compensation::CompensationOptions& options)
      : pipeline_(std::make_unique<Compensator>(options), InstanceSync(), *this) {}

  template <typename Sample>
  void take(const Sample& sample) {
    if constexpr (std::is_same_v<Sample, core::AngularRateSample>) {
      pipeline_.push(sample, 1, 0, ++now_ns_);
    } else {
      pipeline_.push(sample, ++now_ns_);
    }
    while (std::exchange(is_notified_, false)) {
      while (pipeline_.engine().learner().run_one()) {
      }
      pipeline_.drain(now_ns_);
    }
  }
  [[nodiscard]] const std::vector<core::CompensatedSample>& answers() const { return answers_; }
  [[nodiscard]] std::uint64_t late_models() const {
    return pipeline_.engine().counts().late_models;
  }

 private:
  AnswerMark prepare(const core::CompensatedSample& answer, std::uint64_t,
                     std::uint32_t) noexcept override {
    prepared_ = answer;
    return {};
  }
  void write_prepared(bool) noexcept override { answers_.push_back(prepared_); }
  void write_prepared_alone() noexcept override {}
  [[nodiscard]] bool has_output_of_one() const noexcept override { return false; }
  [[nodiscard]] bool can_write() const noexcept override { return true; }
  bool is_open() override { return true; }
  void begin_run() override {}
  bool await_model() override { return false; }
  void report_progress(std::uint64_t, core::SensorTime) override {}
  void notify_learner() override { is_notified_ = true; }

  bool is_notified_ = false;
  std::int64_t now_ns_ = 0;
  core::CompensatedSample prepared_{};
  std::vector<core::CompensatedSample> answers_{};
  GyroPipeline<Compensator> pipeline_;
};

void take_in_order_of_time(NotifiedLearner& instance, const Record& record) {
  std::size_t t = 0;
  for (const auto& rate : record.rates) {
    for (; t < record.temperatures.size() && record.temperatures[t].time <= rate.time; ++t)
      instance.take(record.temperatures[t]);
    instance.take(rate);
  }
  for (; t < record.temperatures.size(); ++t) instance.take(record.temperatures[t]);
}

// Rule: where a rest ends with more labels on their way than there is room for models, the last of
// them is learned too, although no label comes any more: each model that comes into force makes
// room for the next. A label every 10 s that takes effect 60 s later makes six at a time.
TEST(PipelineLearning, ARestThatEndsLeavesNoLabelUnlearned) {
  compensation::CompensationOptions options = compensation::testing::options();
  options.learning.handover_s = 60.0;
  options.earth_rate.mode = compensation::EarthRateMode::kIncluded;
  for (const auto clock : {core::ClockSource::kSimulation, core::ClockSource::kHardware}) {
    const Record record = compensation::make_record({
        .duration_s = 400.0,
        .high_degc = 30.0,
        .clock = clock,
        .motion =
            [](double t_s, core::Axis axis) {
              return t_s > 220.0 && axis == core::Axis::kZ ? 0.02 * std::sin(0.1 * t_s) : 0.0;
            },
    });
    Compensator always_learning{options};
    const auto expected = compensation::testing::run(always_learning, record);
    ASSERT_GT(expected.back().model_epoch, 10U);
    NotifiedLearner instance{options};
    take_in_order_of_time(instance, record);
    EXPECT_EQ(instance.late_models(), 0U);
    const auto& answers = instance.answers();
    ASSERT_EQ(answers.size(), expected.size()) << "clock " << static_cast<int>(clock);
    for (std::size_t k = 0; k < answers.size(); ++k) {
      ASSERT_EQ(answers[k].model_epoch, expected[k].model_epoch) << k;
      ASSERT_EQ(answers[k].rate_radps, expected[k].rate_radps) << k;
    }
  }
}

}  // namespace
}  // namespace zerodrift::service
