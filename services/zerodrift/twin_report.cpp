// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/twin_report.h"

#include <algorithm>
#include <filesystem>
#include <string>

#include "common/core/not_known.h"
#include "common/report/plain_text.h"
#include "services/zerodrift/diagnosis_event.h"

namespace zerodrift::services {
namespace {

using diagnosis::AxisDiagnosis;
using namespace std::chrono_literals;

constexpr std::size_t kMostPoints = 720;
constexpr std::size_t kMostEffects = 16;
constexpr std::size_t kLongestText = 255;
constexpr std::size_t kLongestName = 96;
using core::kNaN;
constexpr std::size_t kLongestEffect = 48;
constexpr std::size_t kMostAlternatives = 8;
constexpr auto kSubscriberWithin = 5000ms;
constexpr auto kReceivedWithin = 2000ms;

std::string cut(const std::string& text, std::size_t longest) {
  return report::shortened(report::one_line(text), longest);
}

std::string file_name(const std::string& path) {
  return cut(std::filesystem::path(path).filename().string(), kLongestName);
}

msg::NamedEffect message_of(const diagnosis::NamedEffect& effect) {
  msg::NamedEffect message;
  message.name(cut(effect.name, kLongestEffect).c_str());
  const std::size_t alternatives = std::min(effect.alternatives.size(), kMostAlternatives);
  for (std::size_t i = 0; i < alternatives; ++i) {
    msg::Alternative& other = message.alternatives().emplace_back();
    other.name(cut(effect.alternatives[i].name, kLongestEffect).c_str());
    other.probability(effect.alternatives[i].probability);
  }
  message.probability(effect.probability);
  message.share_of_gap(effect.share_of_gap);
  return message;
}

double mean(const std::vector<double>& values, std::size_t begin, std::size_t end) {
  double sum = 0.0;
  for (std::size_t i = begin; i < end; ++i) sum += values[i];
  return sum / static_cast<double>(end - begin);
}

// `input`: of the same spans as the curves; empty where nothing is known.
std::vector<msg::TwinPoint> points_of(const diagnosis::Waveforms& curves,
                                      const std::vector<double>& input) {
  const std::size_t count = curves.time_s.size();
  const std::size_t span = (count + kMostPoints - 1) / kMostPoints;
  std::vector<msg::TwinPoint> points;
  for (std::size_t begin = 0; begin < count; begin += span) {
    const std::size_t end = std::min(begin + span, count);
    msg::TwinPoint& point = points.emplace_back();
    point.time_s(mean(curves.time_s, begin, end));
    point.measured_radps(mean(curves.measured_radps, begin, end));
    point.twin_radps(mean(curves.before_radps, begin, end));
    point.repaired_radps(mean(curves.after_radps, begin, end));
    point.input(input.size() == count ? mean(input, begin, end) : kNaN);
  }
  return points;
}

msg::TwinReport report_of(const AxisDiagnosis& found) {
  const bool held_out = found.held_out_kind != diagnosis::HeldOut::kNothing;
  const diagnosis::Gap& gap = held_out ? found.held_out : found.fit;
  msg::TwinReport message;
  message.held_out(held_out ? 1 : 0);
  message.verdict(std::string(diagnosis::name(found.verdict)).c_str());
  message.text(cut(found.sentence, kLongestText).c_str());
  message.next_experiment(cut(found.next_experiment, kLongestText).c_str());
  message.before_rms_radps(gap.before_rms_radps);
  message.after_rms_radps(gap.after_rms_radps);
  message.noise_floor_rms_radps(gap.noise_floor_rms_radps);
  const std::size_t effects = std::min(found.effects.size(), kMostEffects);
  for (std::size_t i = 0; i < effects; ++i)
    message.effects().push_back(message_of(found.effects[i]));
  const diagnosis::ResidualAgainstInput against =
      found.residual.value_or(diagnosis::ResidualAgainstInput{});
  message.input(cut(against.input, kLongestName).c_str());
  message.points(points_of(found.waveforms, against.value));
  return message;
}

}  // namespace

std::vector<msg::TwinReport> twin_reports(const DiagnosisResult& result, std::uint32_t gyro_id,
                                          std::int64_t sensor_time_ns, std::int64_t wall_time_ns) {
  std::vector<msg::TwinReport> reports;
  for (const auto axis : core::kAxes) {
    const auto& found = result.diagnosis.axes[core::index(axis)];
    if (!found) continue;
    msg::TwinReport& message = reports.emplace_back(report_of(*found));
    message.gyro_id(gyro_id);
    message.axis(static_cast<std::uint32_t>(core::index(axis)));
    message.sensor_time_ns(sensor_time_ns);
    message.wall_time_ns(wall_time_ns);
    message.model(file_name(result.model).c_str());
    message.record(file_name(result.record.file).c_str());
  }
  return reports;
}

Finding finding(const DiagnosisResult& result, std::uint32_t gyro_id, std::int64_t sensor_time_ns,
                std::int64_t wall_time_ns) {
  return {.event = diagnosis_event(result, gyro_id, sensor_time_ns),
          .reports = twin_reports(result, gyro_id, sensor_time_ns, wall_time_ns)};
}

Publication publish(Finding found, const dds::NetworkOptions& network) {
  service::Host host("diagnose", network);
  dds::Writer<msg::TwinReport> writer(host.participant(), host.observer());
  auto published = Publication::kNobodyThere;
  auto waited = 0ms;
  bool said = false;
  const auto tick = [&] {
    if (said) {  // the event went out with the tick before
      if (writer.wait_until_received(kReceivedWithin)) published = Publication::kReceived;
      service::request_stop();
    } else if (writer.matched() > 0) {
      said = true;
      host.raise(found.event);
      for (msg::TwinReport& report : found.reports) writer.write(report);
    } else if ((waited += 250ms) > kSubscriberWithin) {
      service::request_stop();
    }
  };
  const auto status = [] {
    service::Status now;
    now.summary = "publishing a diagnosis";
    return now;
  };
  host.run(status, tick);
  return published;
}

}  // namespace zerodrift::services
