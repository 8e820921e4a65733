// SPDX-License-Identifier: Apache-2.0
#include "common/record/mcap_rows.h"

#include <algorithm>

#include "common/core/counted.h"
#include "common/core/integer_time.h"
#include "common/core/median.h"
#include "common/files/file_error.h"
#include "common/mcap/mcap_error.h"
#include "common/record/bag_files.h"
#include "common/record/csv_cells.h"
#include "common/record/decimal_time.h"

namespace zerodrift::record {
namespace {

constexpr std::size_t kRatesForPeriod = 1001;
constexpr std::size_t kStepsForPeriod = 100;
constexpr core::PerAxis<bool> kAllAxes{true, true, true};

// From an earlier time to a later one; any stamps, also those no clock ever showed.
double seconds_between(core::SensorTime earlier, core::SensorTime later) {
  core::SensorTime::rep step = 0;
  if (__builtin_sub_overflow(later.count(), earlier.count(), &step))
    return core::seconds(core::SensorTime::max());
  return core::seconds(core::SensorTime{step});
}

void add_axes(const core::PerAxis<bool>& valid, core::PerAxis<bool>& axes) {
  for (std::size_t i = 0; i < core::kAxisCount; ++i) axes[i] = axes[i] || valid[i];
}

std::string left_out_line(const std::string& file, std::uint64_t samples, const char* where) {
  return file + ": left out: " + core::counted(samples, "sample") +
         " of temperature, reference or environment, stamped more than " +
         std::to_string(core::kLargestStep / std::chrono::seconds(1)) + " s " + where;
}

}  // namespace

McapRows::~McapRows() = default;

McapRows::McapRows(const std::filesystem::path& path, const RecordOptions& options)
    : time_order_(options.time_order) {
  info_.path = path;
  if (!options.columns.empty())
    throw files::FileError(path.string() +
                           ": is an MCAP file, which --columns says nothing of; zerodrift export "
                           "makes a .csv of it, which --columns can be used with");
  try {
    open_files(path);
    messages_ = find_messages(files_, path.string(), options);
    messages_->describe(info_);
    info_.probes = one_line_each(info_.probes);
    look_ahead();
    streams_.emplace(messages_->open(), time_order_);
  } catch (const mcap::McapError& error) {
    throw files::FileError(error.what());
  }
  const auto findings = take_warnings();
  info_.warnings.insert(info_.warnings.end(), findings.begin(), findings.end());
  row_.temperature_degc.assign(info_.probes.size(), kNotMeasured);
  recorded_.temperatures.resize(info_.probes.size());
  reading_numbers_.resize(info_.probes.size());
  row_.recorded = &recorded_;
}

void McapRows::open_files(const std::filesystem::path& path) {
  for (const auto& file : mcap_files_of(path))
    files_.push_back(std::make_shared<mcap::Reader>(file));
  reported_findings_.resize(files_.size());
}

// Through streams of its own, so that the rows are before the first one.
void McapRows::look_ahead() {
  MessageStreams ahead = messages_->open();
  auto& rates = ahead.rates;
  if (!rates.head()) {
    std::string why;
    for (const auto& line : messages_->left_out()) why += "; " + line;
    throw files::FileError(info_.path.string() + ": no message of " + messages_->rates_name() +
                           " can be read" + why);
  }
  info_.first_time = rates.head()->time;
  info_.first_interval_s = rates.head()->interval_s;
  find_columns(ahead);
  if (info_.has_rate == core::PerAxis<bool>{}) {
    if (const std::string problem = messages_->problem_without_rates(); !problem.empty())
      throw files::FileError(info_.path.string() + ": " + problem);
    info_.has_rate.fill(true);
  }
  if (messages_->first_interval_is_missing()) info_.first_interval_s = info_.sample_period_s;
  name_columns();
}

// A column is one of the record wherever in it something was measured first: each stream is gone
// through until all that there can be was found, or to its end.
void McapRows::find_columns(MessageStreams& ahead) {
  std::vector<double> steps_s;
  std::optional<core::SensorTime> previous;
  for (std::size_t i = 0; i < kRatesForPeriod || info_.has_rate != kAllAxes; ++i) {
    const auto rate = ahead.rates.take();
    if (!rate) break;
    add_axes(rate->valid, info_.has_rate);
    if (previous && rate->time > *previous && steps_s.size() < kStepsForPeriod)
      steps_s.push_back(seconds_between(*previous, rate->time));
    previous = rate->time;
  }
  info_.sample_period_s = core::median_of(std::move(steps_s));
  while (info_.has_reference != kAllAxes) {
    const auto reference = ahead.references.take();
    if (!reference) break;
    if (core::is_true_rate(reference->kind)) add_axes(reference->valid, info_.has_reference);
  }
  // Several publishers may have a part of the channels each.
  while (const auto environment = ahead.environment.take())
    info_.environment |= environment->channels;
}

void McapRows::name_columns() {
  info_.columns = {"time_s"};
  for (const auto axis : core::kAxes) {
    if (info_.has_rate[core::index(axis)])
      info_.columns.push_back(column_name({Quantity::kRate, axis, {}}));
  }
  for (const auto axis : core::kAxes) {
    if (info_.has_reference[core::index(axis)])
      info_.columns.push_back(column_name({Quantity::kReference, axis, {}}));
  }
  for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
    if (core::has_channel(info_.environment, i))
      info_.columns.push_back(column_name(environment_channel(i)));
  }
  for (const auto& probe : info_.probes)
    info_.columns.push_back(column_name({Quantity::kTemperature, core::Axis::kX, probe}));
  for (const auto& file : files_) {
    for (const auto& metadata : file->contents().metadata) {
      if (metadata.name != "recording") continue;
      info_.metadata.insert(info_.metadata.end(), metadata.values.begin(), metadata.values.end());
    }
  }
}

const RecordRow* McapRows::next() {
  try {
    while (streams_->has_next()) {
      const core::SensorTime time = streams_->next_time();
      fill(time);
      if (!is_in_order(time)) continue;
      row_.index = rows_++;
      row_.time = time;
      row_.interval_s = previous_time_ && time > *previous_time_
                            ? seconds_between(*previous_time_, time)
                            : (previous_time_ ? 0.0 : info_.sample_period_s);
      previous_time_ = time;
      return &row_;
    }
    if (!is_over_) count_what_is_left();
  } catch (const mcap::McapError& error) {
    throw files::FileError(error.what());
  }
  is_over_ = true;
  return nullptr;
}

// Behind the last rate. What thermometers say a little longer is ordinary; what is stamped before
// it waited behind a stamp that didn't come due.
void McapRows::count_what_is_left() {
  streams_->visit_others([&](auto& stream) {
    while (const auto sample = stream.drop()) {
      if (!has_value(*sample)) continue;
      if (sample->time < *previous_time_) ++left_out_;
      if (core::is_far_ahead(sample->time, *previous_time_)) ++after_the_last_;
    }
  });
}

// Takes what is of this time from each stream.
void McapRows::fill(core::SensorTime time) {
  row_.rate_radps = kNoAxisMeasured;
  row_.reference_radps = {};
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    if (info_.has_reference[i]) row_.reference_radps[i] = kNotMeasured;
  }
  recorded_.begins_anew = streams_->begins_anew();
  recorded_.rate = streams_->take_rate(time);
  if (recorded_.rate) number_rate();
  recorded_.reference = streams_->take_reference(time);
  if (recorded_.reference && core::is_true_rate(recorded_.reference->kind)) {
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      if (info_.has_reference[i] && recorded_.reference->valid[i])
        row_.reference_radps[i] = recorded_.reference->rate_radps[i];
    }
  }
  recorded_.environment = streams_->take_environment(time);
  row_.inputs = recorded_.environment ? recorded_.environment->values : core::Environment{};
  for (std::size_t i = 0; i < recorded_.temperatures.size(); ++i) {
    auto& reading = recorded_.temperatures[i];
    reading = streams_->take_temperature(i, time);
    if (reading) reading_numbers_[i].note(*reading);
    row_.temperature_degc[i] =
        reading && reading->measured ? reading->temperature_degc : kNotMeasured;
  }
}

void McapRows::number_rate() {
  core::AngularRateSample& rate = *recorded_.rate;
  if (rates_++ == 0) rate.interval_s = info_.first_interval_s;
  const auto number = numbers_.number(rate);
  if (!number) {
    throw files::FileError(info_.path.string() + ": " + messages_->rates_name() +
                           ", sequence number " + std::to_string(rate.sequence) +
                           ": numbers go on from two samples in turn; two publishers of one gyro "
                           "at once can't be told apart in a recording");
  }
  rate.sequence = *number;
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    if (rate.valid[i]) row_.rate_radps[i] = rate.rate_radps[i];
  }
}

// A row whose time went back: an error where it holds a rate and a record's promise is asked for.
bool McapRows::is_in_order(core::SensorTime time) {
  if (!previous_time_ || time > *previous_time_) return true;
  if (time_order_ == TimeOrder::kAsFound) {
    ++rows_out_of_order_;
    return true;
  }
  if (!recorded_.rate) {
    ++left_out_;
    return false;
  }
  throw files::FileError(info_.path.string() + ": " + messages_->rates_name() +
                         ", sequence number " + std::to_string(recorded_.rate->sequence) +
                         ": time " + print_seconds(time) + " s is not after the one before (" +
                         print_seconds(*previous_time_) +
                         " s); a record's time strictly increases");
}

std::vector<std::string> McapRows::take_warnings() {
  std::vector<std::string> news;
  for (std::size_t i = 0; i < files_.size(); ++i) {
    const auto& findings = files_[i]->findings();
    news.insert(news.end(), findings.begin() + static_cast<std::ptrdiff_t>(reported_findings_[i]),
                findings.end());
    reported_findings_[i] = findings.size();
  }
  if (left_out_ > 0 && !reported_left_out_) {
    reported_left_out_ = true;
    news.push_back(info_.path.string() +
                   ": temperatures, references or environment whose time went back are left out");
  }
  if (is_over_ && !reported_missed_) {
    reported_missed_ = true;
    if (const std::uint64_t ahead = streams_->dropped(); ahead > 0)
      news.push_back(left_out_line(info_.path.string(), ahead, "ahead of a later one"));
    if (after_the_last_ > 0)
      news.push_back(left_out_line(info_.path.string(), after_the_last_, "after the last rate"));
    for (const auto& line : messages_->left_out())
      news.push_back(info_.path.string() + ": " + line);
    if (numbers_.later_runs() > 0) {
      news.push_back(info_.path.string() + ": the gyro's publisher was started again (" +
                     std::to_string(numbers_.later_runs()) +
                     "x) and counted from the beginning; its samples are numbered on");
    }
    for (std::size_t i = 0; i < reading_numbers_.size(); ++i) {
      if (reading_numbers_[i].are_of_two_publishers())
        news.push_back(info_.path.string() + ": two publishers gave temperatures of probe '" +
                       info_.probes[i] +
                       "' at once, which can't be told apart in a recording: they are mixed; each "
                       "thermometer needs a probe name of its own");
    }
  }
  return news;
}

}  // namespace zerodrift::record
