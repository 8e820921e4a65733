// SPDX-License-Identifier: Apache-2.0
// Functions that write take their object apart by structured bindings that name every member: a
// member added later does not compile until it is written too.
#include "common/checkpoint/learner_message.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "common/checkpoint/checkpoint_error.h"

namespace zerodrift::checkpoint {

using namespace compensation;

namespace {

using Doubles = google::protobuf::RepeatedField<double>;
using Numbers = google::protobuf::RepeatedField<std::uint64_t>;

void require(bool condition, const char* what) {
  if (!condition) throw CheckpointError(std::string("found ") + what);
}

void write(const std::vector<double>& values, Doubles& out) {
  out.Add(values.begin(), values.end());
}

std::vector<double> read(const Doubles& in) {
  return {in.begin(), in.end()};
}

template <typename Number>
void write(const std::vector<Number>& values, Numbers& out) {
  out.Add(values.begin(), values.end());
}

template <typename Number>
std::vector<Number> read_numbers(const Numbers& in) {
  return {in.begin(), in.end()};
}

// One byte each.
template <typename Enum>
std::string bytes_of(const std::vector<Enum>& values) {
  std::string bytes;
  for (const Enum value : values) bytes.push_back(static_cast<char>(value));
  return bytes;
}

template <typename Enum>
std::vector<Enum> enums_of(const std::string& bytes) {
  std::vector<Enum> values;
  for (const char byte : bytes)
    values.push_back(static_cast<Enum>(static_cast<unsigned char>(byte)));
  return values;
}

// An array of the size it has here.
template <std::size_t N>
std::array<double, N> read_array(const Doubles& in) {
  require(in.size() == static_cast<int>(N), "a wrong number of values");
  std::array<double, N> out{};
  std::copy(in.begin(), in.end(), out.begin());
  return out;
}

// --- labels

void write(const AxisLabel& label, proto::LabelCheckpoint& out) {
  const auto& [time, drift, variance, features] = label;
  out.set_time_ns(time.count());
  out.set_drift_radps(drift);
  out.set_variance(variance);
  if (features) out.mutable_features()->Add(features->begin(), features->end());
}

AxisLabel read(const proto::LabelCheckpoint& in) {
  AxisLabel label{.time = core::SensorTime{in.time_ns()},
                  .drift_radps = in.drift_radps(),
                  .variance = in.variance()};
  if (!in.features().empty()) label.features = read_array<thermal::kMaxFeatures>(in.features());
  return label;
}

void write(const HeldLabelState& held, proto::HeldLabelCheckpoint& out) {
  const auto& [label, slot, arrival] = held;
  write(label, *out.mutable_label());
  if (slot) out.set_slot(*slot);
  out.set_arrival(arrival);
}

HeldLabelState read(const proto::HeldLabelCheckpoint& in) {
  HeldLabelState held{.label = read(in.label()), .slot = {}, .arrival = in.arrival()};
  if (in.has_slot()) held.slot = in.slot();
  return held;
}

// --- the SVR

void write(const regression::Kernel& kernel, proto::KernelCheckpoint& out) {
  const auto& [kind, gamma, degree, offset] = kernel;
  out.set_kind(static_cast<std::uint32_t>(kind));
  out.set_gamma(gamma);
  out.set_degree(degree);
  out.set_offset(offset);
}

regression::Kernel read(const proto::KernelCheckpoint& in) {
  require(in.kind() <= static_cast<std::uint32_t>(regression::KernelKind::kLinear),
          "an unknown kernel");
  return {.kind = static_cast<regression::KernelKind>(in.kind()),
          .gamma = in.gamma(),
          .degree = in.degree(),
          .offset = in.offset()};
}

void write(const regression::OnlineSvrOptions& options, proto::SvrOptionsCheckpoint& out) {
  const auto& [dimension, capacity, kernel, epsilon, box_constraint, kkt_tolerance, event_budget,
               window, recent_capacity] = options;
  out.set_dimension(dimension);
  out.set_capacity(capacity);
  write(kernel, *out.mutable_kernel());
  out.set_epsilon(epsilon);
  out.set_box_constraint(box_constraint);
  out.set_kkt_tolerance(kkt_tolerance);
  out.set_event_budget(event_budget);
  out.set_window(static_cast<std::uint32_t>(window));
  out.set_recent_capacity(recent_capacity);
}

regression::OnlineSvrOptions read(const proto::SvrOptionsCheckpoint& in) {
  require(in.window() <= static_cast<std::uint32_t>(regression::WindowPolicy::kTwoTier),
          "an unknown window");
  return {.dimension = in.dimension(),
          .capacity = in.capacity(),
          .kernel = read(in.kernel()),
          .epsilon = in.epsilon(),
          .box_constraint = in.box_constraint(),
          .kkt_tolerance = in.kkt_tolerance(),
          .event_budget = in.event_budget(),
          .window = static_cast<regression::WindowPolicy>(in.window()),
          .recent_capacity = in.recent_capacity()};
}

void write(const regression::OnlineSvrState& state, proto::SvrCheckpoint& out) {
  const auto& [features, targets, weights, thetas, residuals, arrivals, sets, tiers, margin_slots,
               margin_factor, unsettled_slots, forgotten_slots, bias, arrival_count,
               refresh_cursor] = state;
  write(features, *out.mutable_features());
  write(targets, *out.mutable_targets());
  write(weights, *out.mutable_weights());
  write(thetas, *out.mutable_thetas());
  write(residuals, *out.mutable_residuals());
  write(arrivals, *out.mutable_arrivals());
  out.set_sets(bytes_of(sets));
  out.set_tiers(bytes_of(tiers));
  write(margin_slots, *out.mutable_margin_slots());
  write(margin_factor, *out.mutable_margin_factor());
  write(unsettled_slots, *out.mutable_unsettled_slots());
  write(forgotten_slots, *out.mutable_forgotten_slots());
  out.set_bias(bias);
  out.set_arrival_count(arrival_count);
  out.set_refresh_cursor(refresh_cursor);
}

regression::OnlineSvrState read(const proto::SvrCheckpoint& in) {
  return {.features = read(in.features()),
          .targets = read(in.targets()),
          .weights = read(in.weights()),
          .thetas = read(in.thetas()),
          .residuals = read(in.residuals()),
          .arrivals = read_numbers<std::uint64_t>(in.arrivals()),
          .sets = enums_of<regression::SampleSet>(in.sets()),
          .tiers = enums_of<regression::WindowTier>(in.tiers()),
          .margin_slots = read_numbers<std::size_t>(in.margin_slots()),
          .margin_factor = read(in.margin_factor()),
          .unsettled_slots = read_numbers<std::size_t>(in.unsettled_slots()),
          .forgotten_slots = read_numbers<std::size_t>(in.forgotten_slots()),
          .bias = in.bias(),
          .arrival_count = in.arrival_count(),
          .refresh_cursor = in.refresh_cursor()};
}

// --- forecasts

void write(const DriftModelState& model, proto::DriftModelCheckpoint& out) {
  const auto& [time, held, slope, held_variance, predicted_held, trained, offset, scale] = model;
  if (time != core::kNever) out.set_time_ns(time.count());
  out.set_held_radps(held);
  if (slope) out.set_held_slope_radps2(*slope);
  out.set_held_variance(held_variance);
  out.set_predicted_held_radps(predicted_held);
  out.set_trained(trained);
  out.set_offset_radps(offset);
  out.set_scale_radps(scale);
}

DriftModelState read(const proto::DriftModelCheckpoint& in) {
  DriftModelState model{.time = in.has_time_ns() ? core::SensorTime{in.time_ns()} : core::kNever,
                        .held_radps = in.held_radps(),
                        .held_slope_radps2 = {},
                        .held_variance = in.held_variance(),
                        .predicted_held_radps = in.predicted_held_radps(),
                        .trained = in.trained(),
                        .offset_radps = in.offset_radps(),
                        .scale_radps = in.scale_radps()};
  if (in.has_held_slope_radps2()) model.held_slope_radps2 = in.held_slope_radps2();
  return model;
}

void write(const KeptModelState& kept, proto::KeptModelCheckpoint& out) {
  const auto& [drift, predictor, domain] = kept;
  const auto& [kernel, bias, features, weights] = predictor;
  write(drift, *out.mutable_drift());
  write(kernel, *out.mutable_kernel());
  out.set_bias(bias);
  write(features, *out.mutable_features());
  write(weights, *out.mutable_weights());
  write(domain, *out.mutable_domain());
}

KeptModelState read(const proto::KeptModelCheckpoint& in) {
  return {.drift = read(in.drift()),
          .predictor = {.kernel = read(in.kernel()),
                        .bias = in.bias(),
                        .features = read(in.features()),
                        .weights = read(in.weights())},
          .domain = read(in.domain())};
}

void write(const ForecastJudge::Experience& seen, proto::ExperienceCheckpoint& out) {
  const auto& [windows, error_scale, scale_windows, change_change, change_level, level_level,
               change_error, level_error, forecast_loss, held_loss, model_loss, forecast_square,
               held_square, square_weight, label_variance, weights] = seen;
  const auto& [change, level] = weights;
  out.set_windows(windows);
  out.set_error_scale(error_scale);
  out.set_scale_windows(scale_windows);
  out.set_change_change(change_change);
  out.set_change_level(change_level);
  out.set_level_level(level_level);
  out.set_change_error(change_error);
  out.set_level_error(level_error);
  out.set_forecast_loss(forecast_loss);
  out.set_held_loss(held_loss);
  out.set_model_loss(model_loss);
  out.set_forecast_square(forecast_square);
  out.set_held_square(held_square);
  out.set_square_weight(square_weight);
  out.set_label_variance(label_variance);
  out.set_change(change);
  out.set_level(level);
}

ForecastJudge::Experience read(const proto::ExperienceCheckpoint& in) {
  return {.windows = in.windows(),
          .error_scale = in.error_scale(),
          .scale_windows = in.scale_windows(),
          .change_change = in.change_change(),
          .change_level = in.change_level(),
          .level_level = in.level_level(),
          .change_error = in.change_error(),
          .level_error = in.level_error(),
          .forecast_loss = in.forecast_loss(),
          .held_loss = in.held_loss(),
          .model_loss = in.model_loss(),
          .forecast_square = in.forecast_square(),
          .held_square = in.held_square(),
          .square_weight = in.square_weight(),
          .label_variance = in.label_variance(),
          .weights = {in.change(), in.level()}};
}

void write(const HorizonState& horizon, proto::HorizonCheckpoint& out) {
  const auto& [judged, waiting, learned, beyond, moved_square, moved_weight, aged, last_judged] =
      horizon;
  if (judged) write(*judged, *out.mutable_judged());
  if (waiting) write(*waiting, *out.mutable_waiting());
  write(learned, *out.mutable_learned());
  write(beyond, *out.mutable_beyond());
  out.set_moved_square(moved_square);
  out.set_moved_weight(moved_weight);
  out.set_aged(aged);
  if (last_judged != core::kNever) out.set_last_judged_ns(last_judged.count());
}

HorizonState read(const proto::HorizonCheckpoint& in) {
  HorizonState horizon;
  if (in.has_judged()) horizon.judged = read(in.judged());
  if (in.has_waiting()) horizon.waiting = read(in.waiting());
  horizon.learned = read(in.learned());
  horizon.beyond = read(in.beyond());
  horizon.moved_square = in.moved_square();
  horizon.moved_weight = in.moved_weight();
  horizon.aged = in.aged();
  if (in.has_last_judged_ns()) horizon.last_judged = core::SensorTime{in.last_judged_ns()};
  return horizon;
}

void write(const ForecastTrust& trust, proto::TrustCheckpoint& out) {
  const auto& [weights, forecast_variance, held_variance] = trust;
  const auto& [change, level] = weights;
  out.set_change(change);
  out.set_level(level);
  out.set_forecast_variance(forecast_variance);
  out.set_held_variance(held_variance);
}

ForecastTrust read(const proto::TrustCheckpoint& in) {
  return {.weights = {in.change(), in.level()},
          .forecast_variance = in.forecast_variance(),
          .held_variance = in.held_variance()};
}

void write(const TrustTable& table, proto::AxisCheckpoint& out) {
  const auto& [learned, beyond, horizon_s, largest_change_radps] = table;
  for (const auto& trust : learned) write(trust, *out.add_learned());
  for (const auto& trust : beyond) write(trust, *out.add_beyond());
  out.mutable_horizon_s()->Add(horizon_s.begin(), horizon_s.end());
  out.mutable_largest_change_radps()->Add(largest_change_radps.begin(), largest_change_radps.end());
}

TrustTable read_table(const proto::AxisCheckpoint& in) {
  constexpr int kCount = static_cast<int>(kHorizons);
  require(in.learned_size() == kCount && in.beyond_size() == kCount,
          "a wrong number of entries of trust");
  TrustTable table;
  for (int k = 0; k < kCount; ++k) {
    table.learned[static_cast<std::size_t>(k)] = read(in.learned(k));
    table.beyond[static_cast<std::size_t>(k)] = read(in.beyond(k));
  }
  table.horizon_s = read_array<kHorizons>(in.horizon_s());
  table.largest_change_radps = read_array<kHorizons>(in.largest_change_radps());
  return table;
}

// --- an axis

void write(const AxisLearnerState& axis, proto::AxisCheckpoint& out) {
  const auto& [initial, svr_options, svr, labels, next_selection, minute, model, judge] = axis;
  const auto& [horizons, table] = judge;
  for (const auto& label : initial) write(label, *out.add_initial());
  write(svr_options, *out.mutable_svr_options());
  write(svr, *out.mutable_svr());
  out.set_labels(labels);
  out.set_next_selection(next_selection);
  for (const auto& held : minute) write(held, *out.add_minute());
  write(model, *out.mutable_model());
  for (const auto& horizon : horizons) write(horizon, *out.add_judged());
  write(table, out);
}

AxisLearnerState read(const proto::AxisCheckpoint& in) {
  AxisLearnerState axis;
  for (const auto& label : in.initial()) axis.initial.push_back(read(label));
  axis.svr_options = read(in.svr_options());
  axis.svr = read(in.svr());
  axis.labels = in.labels();
  axis.next_selection = in.next_selection();
  for (const auto& held : in.minute()) axis.minute.push_back(read(held));
  axis.model = read(in.model());
  require(in.judged_size() == static_cast<int>(kHorizons), "a wrong number of horizons");
  for (int k = 0; k < in.judged_size(); ++k)
    axis.judge.horizons[static_cast<std::size_t>(k)] = read(in.judged(k));
  axis.judge.table = read_table(in);
  return axis;
}

}  // namespace

void to_message(const LearnerState& state, proto::LearnerCheckpoint& message) {
  const auto& [axes, epoch, labels] = state;
  message.set_epoch(epoch);
  message.set_labels(labels);
  for (const auto& axis : axes) write(axis, *message.add_axes());
}

LearnerState from_message(const proto::LearnerCheckpoint& message) {
  require(message.axes_size() == static_cast<int>(core::kAxisCount), "a wrong number of axes");
  LearnerState state;
  state.epoch = message.epoch();
  state.labels = message.labels();
  for (int i = 0; i < message.axes_size(); ++i)
    state.axes[static_cast<std::size_t>(i)] = read(message.axes(i));
  return state;
}

}  // namespace zerodrift::checkpoint
