// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/bench_fleet_gyros.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/service/host.h"
#include "common/service/monotonic_clock.h"
#include "services/zerodrift/answer_counter.h"
#include "services/zerodrift/bench_fleet_law.h"
#include "services/zerodrift/bench_fleet_network.h"
#include "services/zerodrift/bench_process.h"

namespace zerodrift::services {
namespace {

using namespace std::chrono_literals;

constexpr auto kFoundWithin = 60s;
constexpr auto kAnnounced = 2000ms;  // the first announcements are out (common/dds: 20 in 1 s)
constexpr auto kAnswerWithin = 20000ms;
constexpr double kNextRate = 2.0 / 3.0;
constexpr double kLowestRateHz = 5.0;
constexpr double kLateAtMost = 0.01;  // of the samples, at a rate that holds
constexpr double kWarmUpS = 0.5;
constexpr double kKibPerMib = 1024.0;

double seconds_since(std::int64_t begin_ns) {
  return 1e-9 * static_cast<double>(service::monotonic_ns() - begin_ns);
}

class Gyros {
 public:
  Gyros(const FleetGyrosOptions& options, std::uint32_t gyros)
      : options_(options),
        before_(network_counts()),
        own_before_s_(own_cpu_s()),
        started_ns_(service::monotonic_ns()),
        subscriber_(options.domain, gyros, options.deadline_ms),
        compensation_("compensation",
                      {"--domain", std::to_string(options.domain), "--max-gyros", "128"},
                      BenchProcess::Streams::kQuiet),
        fleet_("zerodrift",
               {"bench", "gyro-fleet", "--gyros", std::to_string(gyros), "--domain",
                std::to_string(options.domain)},
               BenchProcess::Streams::kTalks) {
    result_.gyros = gyros;
    result_.load = load_average();
  }

  GyrosRun run() {
    find_each_other();
    for (double rate_hz = options_.rate_hz; rate_hz > kLowestRateHz && !holds();
         rate_hz *= kNextRate) {
      stream(rate_hz);
    }
    if (!holds()) result_.rate_hz = 0.0;
    return result_;
  }

 private:
  [[nodiscard]] bool holds() const {
    return result_.sent > 0.0 && result_.lost == 0.0 && result_.late <= kLateAtMost * result_.sent;
  }

  template <typename Condition>
  static void wait_until(Condition condition, const char* otherwise) {
    const auto give_up = std::chrono::steady_clock::now() + kFoundWithin;
    while (!condition()) {
      if (service::wait_for_stop(5ms)) throw std::runtime_error("bench fleet: stopped");
      if (std::chrono::steady_clock::now() > give_up)
        throw std::runtime_error(std::string("bench fleet: ") + otherwise + " within 60 s");
    }
  }

  void find_each_other() {
    wait_until(
        [&] {
          fleet_.say("ready");
          return fleet_.hear(kAnswerWithin) == "yes";
        },
        "not every gyro finds compensation");
    result_.match_s = seconds_since(started_ns_);
    std::this_thread::sleep_for(kAnnounced);
    const NetworkCounts found = network_counts() - before_;
    result_.discovery_datagrams = static_cast<double>(found.datagrams);
    result_.discovery_bytes = static_cast<double>(found.bytes);
    result_.discovery_cpu_s =
        fleet_.usage().cpu_s + compensation_.usage().cpu_s + own_cpu_s() - own_before_s_;
    const std::int64_t first_ns = service::monotonic_ns();
    order(options_.rate_hz, 1);
    wait_until(
        [&] {
          if (subscriber_.heard_all()) return true;
          order(options_.rate_hz, 1);
          return false;
        },
        "not every gyro is answered");
    result_.answer_s = seconds_since(first_ns);
  }

  // Waits for the answers, or until they will never come.
  std::uint64_t order(double rate_hz, std::uint64_t count) {
    const std::uint64_t before = subscriber_.counts().received;
    std::ostringstream text;
    text << "send " << rate_hz << ' ' << count;
    fleet_.say(text.str());
    fleet_.hear(kAnswerWithin + std::chrono::milliseconds(static_cast<std::int64_t>(
                                    4000.0 * static_cast<double>(count) / rate_hz)));
    const std::uint64_t sent = count * result_.gyros;
    for (int hundredth = 0; hundredth < 100 && subscriber_.counts().received - before < sent;
         ++hundredth)
      std::this_thread::sleep_for(10ms);
    return sent;
  }

  struct Look {
    NetworkCounts network = network_counts();
    double publisher_s = 0.0;
    double compensation_s = 0.0;
    double own_s = own_cpu_s();
    std::int64_t at_ns = service::monotonic_ns();
    std::uint64_t received = 0;
    std::uint64_t late = 0;
  };
  [[nodiscard]] Look look() const {
    Look now;
    now.publisher_s = fleet_.usage().cpu_s;
    now.compensation_s = compensation_.usage().cpu_s;
    const auto answers = subscriber_.counts();
    now.received = answers.received;
    now.late = answers.late;
    return now;
  }

  void stream(double rate_hz) {
    const auto count_in = [&](double duration_s) {
      return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(rate_hz * duration_s + 0.5));
    };
    order(rate_hz, count_in(kWarmUpS));
    const Look before = look();
    const std::uint64_t sent = order(rate_hz, count_in(options_.seconds));
    const Look after = look();
    const double window_s = 1e-9 * static_cast<double>(after.at_ns - before.at_ns);
    const auto share = [&](double from_s, double to_s) {
      return 100.0 * (to_s - from_s) / window_s;
    };
    const NetworkCounts network = after.network - before.network;
    result_.rate_hz = rate_hz;
    result_.sent = static_cast<double>(sent);
    result_.lost =
        std::max(0.0, result_.sent - static_cast<double>(after.received - before.received));
    result_.late = static_cast<double>(after.late - before.late);
    result_.datagrams_per_s = static_cast<double>(network.datagrams) / window_s;
    result_.bytes_per_s = static_cast<double>(network.bytes) / window_s;
    result_.publisher_cpu_percent = share(before.publisher_s, after.publisher_s);
    result_.compensation_cpu_percent = share(before.compensation_s, after.compensation_s);
    result_.subscriber_cpu_percent = share(before.own_s, after.own_s);
    result_.publisher_resident_mib = static_cast<double>(fleet_.usage().resident_kb) / kKibPerMib;
    result_.compensation_resident_mib =
        static_cast<double>(compensation_.usage().resident_kb) / kKibPerMib;
  }

  const FleetGyrosOptions& options_;
  NetworkCounts before_;
  double own_before_s_;
  std::int64_t started_ns_;
  GyrosRun result_;
  AnswerCounter subscriber_;
  BenchProcess compensation_;
  BenchProcess fleet_;
};

// Of the runs at the lowest rate that any of them came to: all else is not of one rate.
GyrosRun median_of_runs(std::vector<GyrosRun> runs) {
  if (runs.empty()) return {};
  double rate_hz = runs[0].rate_hz;
  for (const GyrosRun& run : runs) rate_hz = std::min(rate_hz, run.rate_hz);
  std::erase_if(runs, [&](const GyrosRun& run) { return run.rate_hz != rate_hz; });
  if (runs.empty()) return {};
  GyrosRun median = runs[0];
  for (auto value :
       {&GyrosRun::match_s, &GyrosRun::answer_s, &GyrosRun::discovery_datagrams,
        &GyrosRun::discovery_bytes, &GyrosRun::discovery_cpu_s, &GyrosRun::sent, &GyrosRun::lost,
        &GyrosRun::late, &GyrosRun::datagrams_per_s, &GyrosRun::bytes_per_s,
        &GyrosRun::publisher_cpu_percent, &GyrosRun::compensation_cpu_percent,
        &GyrosRun::subscriber_cpu_percent, &GyrosRun::publisher_resident_mib,
        &GyrosRun::compensation_resident_mib, &GyrosRun::load}) {
    std::vector<double> values;
    for (const GyrosRun& run : runs) values.push_back(run.*value);
    median.*value = median_of(std::move(values));
  }
  return median;
}

}  // namespace

std::vector<GyrosRun> measure_gyros(const FleetGyrosOptions& options,
                                    const std::function<void(const GyrosRun&)>& done) {
  std::vector<GyrosRun> result;
  for (const std::uint32_t gyros : options.gyros) {
    std::vector<GyrosRun> runs;
    for (std::uint32_t repeat = 0; repeat < options.repeats; ++repeat) {
      try {
        runs.push_back(Gyros(options, gyros).run());
      } catch (const std::runtime_error&) {  // a process said nothing for too long: none holds
        if (service::wait_for_stop(0ms)) throw;
        runs.push_back(GyrosRun{.gyros = gyros});
      }
    }
    result.push_back(median_of_runs(std::move(runs)));
    done(result.back());
  }
  return result;
}

}  // namespace zerodrift::services
