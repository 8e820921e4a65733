// SPDX-License-Identifier: Apache-2.0
// What a navigation filter makes of one gyro: attitude from its raw rates beside attitude from its
// compensated rates and, where the true rate is known and the attitude that it begins from, beside
// the true attitude; and what it can tell the compensation in return. The one implementation that
// the service and `zerodrift navigate` share.
//
// One decision of rest serves all streams. At rest, means over a second update each filter once the
// second after has shown that they ended before any motion began, from the first on that the second
// after agrees with. At the start attitude is held
// (alignment) for as long as the vehicle stands, at most alignment_s; heading is as configured or,
// without, from the Earth's rate (gyrocompass.h).
//
// Driven by sensor time, no clock, no allocation after the constructor; O(1) a sample.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "common/core/ring_buffer.h"
#include "common/core/samples.h"
#include "common/navigation/attitude_filter.h"
#include "common/navigation/gyrocompass.h"
#include "common/navigation/reference_at_rest.h"
#include "common/navigation/rest_detector.h"

namespace zerodrift::navigation {

enum class Stream : std::uint8_t { kRaw = 0, kCompensated = 1, kTruth = 2 };
inline constexpr std::size_t kStreams = 3;
enum class Phase : std::uint8_t { kWaiting = 0, kAligning = 1, kNavigating = 2 };
// kNone: free inertial, what drift does is seen in full.
enum class Updates : std::uint8_t { kNone, kAtRest };

struct GyroNavigationOptions {
  BodyFrame frame = BodyFrame::kForwardLeftUp;  // of what comes in and goes out
  Attitude attitude{};                          // at the start; without a heading, roll and pitch
  bool heading_known = true;
  std::optional<Attitude> true_attitude{};  // of the truth at the start; none: as above
  double alignment_s = 60.0;
  Updates updates = Updates::kAtRest;
  AttitudeFilterOptions filter;
  RestDetectorOptions rest;
  double longest_bridged_s = 0.25;    // a gap up to this is turned through at the rates around it
  double fastest_turn_radps = 0.873;  // 50 deg/s: what a longer one may have held, about down
  // What is given back.
  double reference_period_s = 0.1;
  double largest_reference_sigma_radps = 1.454e-6;  // of Earth rate on an axis: 0.3 deg/h
  bool residual_feedback = false;

  // Nothing when usable, else one line that names the wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// A compensated sample as this folder needs it, in the configured frame. Variances below 0:
// unknown.
struct NavigationSample {
  std::uint64_t sequence = 0;
  core::SensorTime time{0};
  double interval_s = 0.0;
  core::PerAxis<double> rate_radps{};           // compensated
  core::PerAxis<double> applied_drift_radps{};  // raw = compensated + applied
  core::PerAxis<bool> valid{};
  core::PerAxis<bool> clipped{};
  core::PerAxis<double> noise_variance{-1.0, -1.0, -1.0};
  core::PerAxis<double> drift_variance{-1.0, -1.0, -1.0};
  std::uint64_t model_epoch = 0;
  core::PerAxis<std::uint8_t> rung{};
  bool late = false;
  std::optional<core::PerAxis<double>> specific_force_mps2{};
};

// Of one stream, since navigation began. Angles in rad.
struct StreamErrors {
  std::uint64_t samples = 0;
  double heading_now = 0.0;
  double heading_sigma_now = 0.0;  // of the filter then
  double heading_square_sum = 0.0;
  double heading_largest = 0.0;  // magnitude
  double angle_now = 0.0;
  double nees_sum = 0.0;  // of the attitude error, 3 degrees of freedom

  [[nodiscard]] double heading_rms() const noexcept;
  [[nodiscard]] double nees_mean() const noexcept;
};

struct StreamCounts {
  std::uint64_t updates = 0;
  std::uint64_t rejected = 0;
  double nis_sum = 0.0;
  std::uint64_t nis_degrees = 0;
};

// A given heading that the Earth's rate contradicts.
struct HeadingDoubt {
  double given_rad = 0.0;
  double found_rad = 0.0;
};
// For people.
[[nodiscard]] std::string text(const HeadingDoubt& doubt);

struct NavigationCounts {
  std::uint64_t samples = 0;
  std::uint64_t duplicates = 0;  // times that were there, or behind and out of order
  std::uint64_t late = 0;        // answered out of order: their place has passed
  std::uint64_t unusable = 0;    // an axis invalid that was measured before, or no interval
  std::uint64_t clipped = 0;
  std::uint64_t gaps = 0;    // bridged
  std::uint64_t losses = 0;  // longer: heading uncertain since
  // By a second or less, with nothing lost; else as a loss of unknown length.
  std::uint64_t time_restarts = 0;
  std::uint64_t truth_missing = 0;
  std::uint64_t references = 0;  // given back, with at least one axis
  std::uint64_t residuals = 0;
};

class GyroNavigation {
 public:
  // Throws std::invalid_argument with validate()'s line.
  explicit GyroNavigation(const GyroNavigationOptions& options);

  // The true rate at a sample's time (a rate table, a record's reference columns), before the
  // sample or soon after: once one has arrived, samples wait for theirs in a queue of kWaiting.
  void push_truth(core::SensorTime time, const core::PerAxis<double>& rate_radps) noexcept;
  void push(const NavigationSample& sample) noexcept;
  // Samples that wait for a truth that doesn't come go on without.
  void give_up_waiting() noexcept;

  // What to tell the compensation, in order; nothing: no more. At rest and with Earth rate known,
  // kRest: Earth rate in b, valid on the axes where it is known well enough; otherwise kRest with
  // no axis, so that who waits for it gets on. With residual_feedback, kNavigationResidual after
  // each update at rest: the drift that was applied at that time + what the filter finds left of
  // it. In motion a gyro measures nothing of its drift, so nothing is said: a residual known from
  // before would come back as its own echo.
  [[nodiscard]] std::optional<core::RateReferenceSample> take_reference() noexcept;

  [[nodiscard]] Phase phase() const noexcept { return phase_; }
  [[nodiscard]] bool at_rest() const noexcept { return detector_.standing() == Standing::kAtRest; }
  [[nodiscard]] double rest_s() const noexcept { return rest_s_; }
  [[nodiscard]] core::SensorTime time() const noexcept { return newest_; }
  [[nodiscard]] std::uint64_t sequence() const noexcept { return sequence_; }
  [[nodiscard]] bool truth_received() const noexcept { return truth_.started; }
  // The attitude that true rates begin from is known.
  [[nodiscard]] bool truth_has_start() const noexcept { return truth_.has_start; }
  // The time of the first true rate behind a time without any that was longer than is bridged: the
  // true attitude isn't known since. kNever: there was none.
  [[nodiscard]] core::SensorTime truth_lost_at() const noexcept { return truth_.lost_at; }
  // What true rates were in the first stop.
  [[nodiscard]] std::optional<RestMeans> truth_at_rest() const noexcept {
    return truth_.at_rest.means();
  }
  // Where they were then not what the Earth's rate is in the attitude that is given: they are
  // against the Earth, or in another frame, and nothing is judged by them, nor was.
  [[nodiscard]] const std::optional<RestMeans>& truth_doubt() const noexcept {
    return truth_.doubt;
  }
  // The true attitude is known.
  [[nodiscard]] bool knows_truth() const noexcept {
    return truth_.started && truth_.has_start && truth_.lost_at == core::kNever && !truth_.doubt;
  }
  // True attitude only where knows_truth().
  [[nodiscard]] const Quaternion& n_from_b(Stream stream) const noexcept;
  [[nodiscard]] Attitude attitude(Stream stream) const noexcept {
    return attitude_of(n_from_b(stream));
  }
  // Earth rate in the true attitude, in the configured frame; zero without a latitude.
  [[nodiscard]] core::PerAxis<double> true_earth_rate_radps() const noexcept;
  // Of kRaw and kCompensated.
  [[nodiscard]] const AttitudeFilter& filter(Stream stream) const noexcept {
    return copies_[static_cast<std::size_t>(stream)].filter;
  }
  [[nodiscard]] const StreamErrors& errors(Stream stream) const noexcept {
    return copies_[static_cast<std::size_t>(stream)].errors;
  }
  [[nodiscard]] const StreamCounts& counts(Stream stream) const noexcept {
    return copies_[static_cast<std::size_t>(stream)].counts;
  }
  [[nodiscard]] const NavigationCounts& counts() const noexcept { return counts_; }
  // Why there is no heading, once alignment without one is over.
  [[nodiscard]] std::optional<CompassVerdict> compass() const noexcept { return compass_.verdict; }
  // A filter that starts while the compensation knows the drift already, as after a failure of the
  // one before it, is given the heading of then, not of now. What the first second at rest says of
  // north is held against it, once: contradicted, the heading counts as uncertain by the whole
  // difference, so that no horizontal Earth rate is given back, and there is no true heading.
  [[nodiscard]] const std::optional<HeadingDoubt>& heading_doubt() const noexcept {
    return compass_.doubt;
  }

 private:
  static constexpr std::size_t kWaiting = 64;
  static constexpr std::size_t kRawCopy = static_cast<std::size_t>(Stream::kRaw);
  static constexpr std::size_t kCompensatedCopy = static_cast<std::size_t>(Stream::kCompensated);
  struct Truth {
    core::SensorTime time{0};
    Vector3 rate = Vector3::Zero();
  };
  // What the true rates make of the attitude that is given at the start.
  struct TrueAttitude {
    Strapdown attitude;
    core::RingBuffer<Truth> waiting;
    core::SensorTime spoken_to{core::kNever};
    bool has_start = true;
    bool started = false;
    std::optional<Truth> last{};
    core::SensorTime lost_at{core::kNever};
    ReferenceAtRest at_rest{};
    std::optional<RestMeans> doubt{};
  };
  struct Rates {
    Vector3 raw = Vector3::Zero();
    Vector3 compensated = Vector3::Zero();
    std::array<bool, 3> measured{};
  };
  // The sums of a second at rest.
  struct Block {
    core::SensorTime begin{core::kNever};
    Vector3 sum = Vector3::Zero();      // of the raw rates
    Vector3 squares = Vector3::Zero();  // of them
    Vector3 noise = Vector3::Zero();    // stated variances; NaN where one is missing
    Vector3 force = Vector3::Zero();
    std::uint64_t count = 0;
    std::uint64_t with_force = 0;
    std::array<bool, 3> measured{};
  };
  // What is known of this stop; another begins with nothing. Who comes to rest without a jolt turns
  // at some deg/h for seconds below what rest is told by: a stop has begun with the first of two
  // seconds in turn whose means agree within their noise.
  struct Stop {
    Block block{};
    std::optional<Block> confirmed_next{};
    bool has_begun = false;
    bool levelled = false;
    bool stands = false;  // the newest update found nothing that drift can't be
    bool residual_due = false;
  };
  // What compensated the newest sample.
  struct Model {
    core::PerAxis<double> applied_drift_radps{};
    std::uint64_t epoch = 0;
    core::PerAxis<std::uint8_t> rung{};
    core::PerAxis<bool> claim_known{};
  };
  // The search for north while the attitude is held, or one look at a heading that was given.
  struct Compass {
    std::optional<CompassVerdict> verdict{};
    Vector3 sum = Vector3::Zero();
    std::uint64_t count = 0;
    bool has_checked = false;  // the heading that was given
    std::optional<HeadingDoubt> doubt{};
  };
  // `before` is the filter without what this stop taught it, from the stop's first update on. A
  // rotation that is slow and steady for a few seconds before the vehicle stands was taken for
  // drift, and all that contradicts it would be taken for rotation.
  struct Copy {
    AttitudeFilter filter;
    AttitudeFilter before = filter;
    int agreeing = 0;   // updates of this stop
    int disputing = 0;  // since the newest of them
    StreamErrors errors{};
    StreamCounts counts{};
    Vector3 previous_rate = Vector3::Zero();
  };

  // What befalls a filter at rest befalls the one before the stop.
  template <typename Action>
  void each(Copy& copy, const Action& action) noexcept {
    action(copy.filter);
    if (stop_.has_begun) action(copy.before);
  }
  void process_ready(bool waits) noexcept;
  void process(const NavigationSample& received, const Truth* truth) noexcept;
  [[nodiscard]] bool is_usable(const NavigationSample& sample) noexcept;
  [[nodiscard]] Rates rates_of(const NavigationSample& sample) const noexcept;
  [[nodiscard]] bool follows(const NavigationSample& sample) const noexcept {
    return newest_ != core::kNever && sample.sequence == sequence_ + 1;
  }
  void begin_time_anew() noexcept;
  void pass_gap(const NavigationSample& sample, const Rates& rates) noexcept;
  void lose_heading(double gap_s) noexcept;
  void take_model(const NavigationSample& sample) noexcept;
  void detect(const NavigationSample& sample, const Rates& rates) noexcept;
  void move(const NavigationSample& sample, const Rates& rates) noexcept;
  void move_truth(const Truth* truth, double interval_s) noexcept;
  void lose_truth(core::SensorTime time) noexcept;
  void check_truth(const Truth* truth, core::SensorTime time) noexcept;
  void gather(const NavigationSample& sample, const Rates& rates) noexcept;
  void begin_stop() noexcept;
  [[nodiscard]] Vector3 noise_of_mean(const Block& block) const noexcept;
  [[nodiscard]] bool agree(const Block& first, const Block& second) const noexcept;
  void update(const Block& block) noexcept;
  [[nodiscard]] InnovationReport learn(Copy& copy, const RestMean& mean) noexcept;
  [[nodiscard]] InnovationReport level(AttitudeFilter& filter, const Block& block) const noexcept;
  void align(const NavigationSample& sample) noexcept;
  void begin_navigating() noexcept;
  void find_heading() noexcept;
  void check_heading(const RestMean& mean) noexcept;
  [[nodiscard]] CompassResult compass_of(const Vector3& rate_radps,
                                         const Vector3& noise_variance) const noexcept;
  void judge() noexcept;
  void prepare_references(const NavigationSample& sample) noexcept;
  void prepare_residual(const NavigationSample& sample) noexcept;
  [[nodiscard]] core::RateReferenceSample rest_reference(const NavigationSample& sample) noexcept;

  GyroNavigationOptions options_;
  std::array<Copy, 2> copies_;
  RestDetector detector_;
  TrueAttitude truth_;
  core::RingBuffer<NavigationSample> waiting_;
  core::RingBuffer<core::RateReferenceSample> references_;

  Phase phase_ = Phase::kWaiting;
  core::SensorTime newest_{core::kNever};
  std::uint64_t sequence_ = 0;
  double rest_s_ = 0.0;
  double aligned_s_ = 0.0;
  bool heading_known_;
  double start_heading_sigma_rad_;  // what is given back claims no better knowledge of north
  Compass compass_;
  std::array<core::SensorTime, 3> measured_at_;
  Model model_;
  Stop stop_;
  core::SensorTime reference_due_{core::kNever};
  NavigationCounts counts_;
};

}  // namespace zerodrift::navigation
