// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/gyro_load.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "common/report/json_file.h"
#include "common/service/host.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "services/zerodrift/progress_bar.h"
#include "tests/bench/answer_counter.h"
#include "tests/bench/bench_process.h"

namespace zerodrift::bench {
namespace {

using namespace std::chrono_literals;
constexpr auto kAnswerWithin = 20000ms;
constexpr double kStep = 1.5;
constexpr auto kBacklogGone = 2000ms;  // of a rate that was too much

// One rate: what came of it, and what each process used. CPU in % of a core.
struct Step {
  double rate_hz = 0.0;
  std::uint64_t sent = 0, lost = 0, late = 0;
  double publisher_cpu = 0.0, compensation_cpu = 0.0, subscriber_cpu = 0.0;
  std::int64_t publisher_kb = 0, compensation_kb = 0;
  [[nodiscard]] bool good() const { return lost == 0 && late == 0; }
};

class FleetLoad {
 public:
  FleetLoad(const GyroLoadOptions& options, std::uint32_t gyros)
      : options_(options),
        gyros_(gyros),
        subscriber_(options.domain, gyros, options.deadline_ms),
        compensation_("compensation", {"--domain", std::to_string(options.domain)},
                      BenchProcess::Streams::kQuiet),
        fleet_("zerodrift_bench",
               {"gyro-fleet", "--gyros", std::to_string(gyros), "--domain",
                std::to_string(options.domain)},
               BenchProcess::Streams::kTalks) {
    connect();
  }

  Step run(double rate_hz) {
    send(rate_hz, std::max(0.1 * options_.step_s, 0.1));  // queues and caches settle
    const auto before = subscriber_.counts();
    const double publisher_s = fleet_.usage().cpu_s;
    const double compensation_s = compensation_.usage().cpu_s;
    const double own_s = own_cpu_s();
    const std::uint64_t sent = send(rate_hz, options_.step_s);
    const auto after = subscriber_.counts();
    const std::uint64_t received = after.received - before.received;
    const auto share = [&](double used_s) { return 100.0 * used_s / options_.step_s; };
    return {.rate_hz = rate_hz,
            .sent = sent,
            .lost = sent > received ? sent - received : 0,
            .late = after.late - before.late,
            .publisher_cpu = share(fleet_.usage().cpu_s - publisher_s),
            .compensation_cpu = share(compensation_.usage().cpu_s - compensation_s),
            .subscriber_cpu = share(own_cpu_s() - own_s),
            .publisher_kb = fleet_.usage().resident_kb,
            .compensation_kb = compensation_.usage().resident_kb};
  }

 private:
  void connect() {
    const auto until = std::chrono::steady_clock::now() + kAnswerWithin;
    const auto still = [&] {
      if (std::chrono::steady_clock::now() > until) {
        throw std::runtime_error("bench end-to-end: not every gyro is answered within 20 s");
      }
      std::this_thread::sleep_for(20ms);
    };
    do {
      still();
      fleet_.say("ready");
    } while (fleet_.receive(kAnswerWithin) != "yes");
    while (!subscriber_.received_all()) {
      still();
      send(50.0, 0.1);
    }
  }

  // Samples sent; waits until the answers are there, or will never be.
  std::uint64_t send(double rate_hz, double duration_s) {
    const auto count =
        std::max<std::uint64_t>(1, static_cast<std::uint64_t>(rate_hz * duration_s + 0.5));
    const std::uint64_t before = subscriber_.counts().received;
    std::ostringstream order;
    order << "send " << rate_hz << ' ' << count;
    fleet_.say(order.str());
    fleet_.receive(kAnswerWithin +
                   std::chrono::milliseconds(static_cast<std::int64_t>(4000.0 * duration_s)));
    const std::uint64_t sent = count * gyros_;
    for (int hundredth = 0; hundredth < 100; ++hundredth) {
      if (subscriber_.counts().received - before >= sent) break;
      std::this_thread::sleep_for(10ms);
    }
    return sent;
  }

  const GyroLoadOptions& options_;
  std::uint32_t gyros_;
  AnswerCounter subscriber_;
  BenchProcess compensation_;
  BenchProcess fleet_;
};

struct Outcome {
  std::uint32_t gyros = 0;
  std::optional<Step> last_good{};
  std::optional<Step> first_bad{};
};

Outcome measure(const GyroLoadOptions& options, std::uint32_t gyros, services::ProgressBar& bar) {
  Outcome outcome{.gyros = gyros};
  FleetLoad load(options, gyros);
  for (double rate_hz = options.first_rate_hz;
       rate_hz <= options.largest_rate_hz && !service::wait_for_stop(0ms); rate_hz *= kStep) {
    bar.show(rate_hz / options.largest_rate_hz);
    Step step = load.run(rate_hz);
    // The machine may have stumbled over something else: a rate fails that fails twice.
    if (!step.good()) {
      std::this_thread::sleep_for(kBacklogGone);
      step = load.run(rate_hz);
    }
    if (!step.good()) {
      outcome.first_bad = step;
      break;
    }
    outcome.last_good = step;
  }
  return outcome;
}

void print(const Outcome& outcome) {
  const double gyros = outcome.gyros;
  if (!outcome.last_good) {
    std::printf("%6u%10s\n", outcome.gyros, "none");
  } else {
    const Step& good = *outcome.last_good;
    std::printf("%6u%10.0f%12.0f |%8.2f%8.2f%8.2f |%9.0f%9.0f |", outcome.gyros, good.rate_hz,
                good.rate_hz * gyros, good.publisher_cpu / gyros, good.compensation_cpu / gyros,
                good.subscriber_cpu / gyros, static_cast<double>(good.publisher_kb) / gyros,
                static_cast<double>(good.compensation_kb) / gyros);
    if (!outcome.first_bad) std::printf(" no limit found\n");
  }
  if (outcome.first_bad) {
    const Step& bad = *outcome.first_bad;
    std::printf(" at %.0f Hz: %llu lost, %llu late of %llu\n", bad.rate_hz,
                static_cast<unsigned long long>(bad.lost),
                static_cast<unsigned long long>(bad.late),
                static_cast<unsigned long long>(bad.sent));
  }
  std::fflush(stdout);
}

nlohmann::ordered_json json_of(const Step& step) {
  return {{"rate_hz", step.rate_hz},
          {"sent", step.sent},
          {"lost", step.lost},
          {"late", step.late},
          {"publisher_cpu_percent", step.publisher_cpu},
          {"compensation_cpu_percent", step.compensation_cpu},
          {"subscriber_cpu_percent", step.subscriber_cpu},
          {"publisher_resident_kb", step.publisher_kb},
          {"compensation_resident_kb", step.compensation_kb}};
}

nlohmann::ordered_json json_of(const Outcome& outcome) {
  nlohmann::ordered_json json{{"gyros", outcome.gyros}};
  if (outcome.last_good) json["last_good"] = json_of(*outcome.last_good);
  if (outcome.first_bad) json["first_bad"] = json_of(*outcome.first_bad);
  return json;
}

}  // namespace

int bench_gyro_load(const GyroLoadOptions& options) {
  std::printf(
      "Rising rates, %.3g s each, until a sample is lost or answered more than %.3g ms after it "
      "was\n"
      "due, twice. CPU in %% of a core and resident memory in kB, of each process, for each gyro.\n"
      "%6s%10s%12s |%8s%8s%8s |%9s%9s |\n%6s%10s%12s |%8s%8s%8s |%9s%9s |\n",
      options.step_s, options.deadline_ms, "", "each", "all", "CPU of", "CPU of", "CPU of",
      "memory", "memory", "gyros", "Hz", "samples/s", "publ.", "comp.", "subscr.", "publ.",
      "comp.");
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  bool good = true;
  for (const std::uint32_t gyros : options.gyros) {
    services::ProgressBar bar(std::to_string(gyros) + " gyros");
    const Outcome outcome = measure(options, gyros, bar);
    print(outcome);
    json.push_back(json_of(outcome));
    good = good && outcome.last_good.has_value();
  }
  if (!options.json.empty()) report::write_json(options.json, json);
  return good ? service::kExitDone : service::kExitNo;
}

}  // namespace zerodrift::bench
