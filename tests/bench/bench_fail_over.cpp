// SPDX-License-Identifier: Apache-2.0
// zerodrift_bench fail-over: two instances of the compensation, one gyro, and faults of one and the
// other in turn, round after round. What a subscriber sees of it.
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/compensation/option_keys.h"
#include "common/files/atomic_file.h"
#include "common/service/host.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "services/zerodrift/progress_bar.h"
#include "tests/bench/bench.h"
#include "tests/bench/bench_process.h"
#include "tests/bench/fault_injection.h"
#include "tests/bench/synthetic_gyro.h"

namespace zerodrift::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kDomain = 228;
constexpr auto kFaultLasts = 300ms;
constexpr auto kHangLasts = 1500ms;
// A hung learner is noticed when its model is late, and told at the next look, four a second.
constexpr std::chrono::nanoseconds kGapWithin = 250ms;
constexpr std::chrono::nanoseconds kHangGapWithin = kHangLasts;
constexpr auto kFaultIsOver =
    700ms;  // after a fault's begin: whatever it does to the stream, is done
constexpr auto kAwaitedFor = 60s;
constexpr double kComparedInSync = 50.0;
constexpr double kPeriodsKill = 3.0;
constexpr double kPeriodsStop = 10.0;

// Sensor time runs 10 times as fast as the host's, so delays that jitter may not exceed are longer.
constexpr const char* kConfig =
    "features:\n"
    "  - {kind: temperature, probe: coil}\n"
    "  - {kind: temperature_rate, probe: coil}\n"
    "learning: {handover_s: 4}\n"
    "earth_rate: {mode: included}\n"
    "temperature_delay_s: 2\n";

struct FailOverOptions {
  dds::NetworkOptions network;
  int rounds = 10;
  std::vector<std::string> faults{"kill", "stop", "hang"};
  double rate_hz = 200.0;
  std::string scheme{compensation::scheme_names().front()};
  std::string json;
};

// Everything a subscriber saw.
class Subscriber {
 public:
  explicit Subscriber(dds::Participant& participant)
      : reader_(participant, [this](const msg::CompensatedRate& m, const dds::SampleOrigin&) {
          const std::lock_guard lock(mutex_);
          seen_.push_back({m.sequence_number(), service::monotonic_ns()});
        }) {}

  struct Verdict {
    std::uint64_t lost = 0;
    std::uint64_t repeated = 0;
    std::uint64_t out_of_order = 0;
    double gap_ms = 0.0;        // longest between two arrivals, about the fault
    double later_gap_ms = 0.0;  // and while the other comes back
  };
  // Of the samples that arrived from `since_ns` on, up to `last`; gaps that end by `until_ns`.
  Verdict judge(std::int64_t since_ns, std::uint64_t last, std::int64_t until_ns) {
    const std::lock_guard lock(mutex_);
    Verdict verdict;
    std::map<std::uint64_t, int> count;
    const Seen* before = nullptr;
    for (const Seen& seen : seen_) {
      if (seen.at_ns < since_ns) continue;
      ++count[seen.sequence];
      if (before != nullptr) {
        const double gap_ms = static_cast<double>(seen.at_ns - before->at_ns) * 1e-6;
        double& longest = seen.at_ns <= until_ns ? verdict.gap_ms : verdict.later_gap_ms;
        longest = std::max(longest, gap_ms);
        if (seen.sequence <= before->sequence) ++verdict.out_of_order;
      }
      before = &seen;
    }
    if (count.empty()) throw std::runtime_error("bench fail-over: nothing arrives any more");
    for (const auto& [sequence, times] : count) verdict.repeated += times > 1 ? 1U : 0U;
    for (std::uint64_t sequence = count.begin()->first; sequence <= last; ++sequence)
      verdict.lost += count.contains(sequence) ? 0U : 1U;
    return verdict;
  }
  [[nodiscard]] bool any() {
    const std::lock_guard lock(mutex_);
    return !seen_.empty();
  }
  [[nodiscard]] bool has_seen(std::uint64_t sequence) {
    const std::lock_guard lock(mutex_);
    return std::any_of(seen_.begin(), seen_.end(),
                       [sequence](const Seen& seen) { return seen.sequence >= sequence; });
  }
  void forget() {
    const std::lock_guard lock(mutex_);
    seen_.clear();
  }

 private:
  struct Seen {
    std::uint64_t sequence;
    std::int64_t at_ns;
  };
  std::mutex mutex_;
  std::vector<Seen> seen_;
  dds::Reader<msg::CompensatedRate> reader_;
};

// What the two instances say of themselves.
class Instances {
 public:
  explicit Instances(dds::Participant& participant)
      : reader_(participant, [this](const msg::ServiceStatus& m, const dds::SampleOrigin&) {
          const std::lock_guard lock(mutex_);
          auto& metrics = parts_[m.service().c_str()];
          for (const auto& metric : m.metrics()) metrics[metric.name().c_str()] = metric.value();
        }) {}

  double metric(int instance, const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto part = parts_.find(instance == 0 ? "compensation:1" : "compensation/1:1");
    if (part == parts_.end() || !part->second.contains(name)) return -1.0;
    return part->second.at(name);
  }
  void forget(int instance) {
    const std::lock_guard lock(mutex_);
    parts_.erase(instance == 0 ? "compensation:1" : "compensation/1:1");
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::map<std::string, double>> parts_;
  dds::Reader<msg::ServiceStatus> reader_;
};

struct Round {
  std::string fault;
  Subscriber::Verdict verdict;
  double differing = 0.0;      // once in sync again: answers that are not the other's to the bit
  double in_sync_after_s = 0;  // from the fault's end
};

class FailOver {
 public:
  explicit FailOver(const FailOverOptions& options)
      : options_(options),
        folder_(std::filesystem::temp_directory_path() /
                ("zerodrift_fail_over_" + std::to_string(getpid()))),
        measuring_("gyro_publisher", options.network),
        listening_("console", options.network),
        instances_(listening_),
        subscriber_(listening_) {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "config.yaml") << "scheme: " << options.scheme << '\n' << kConfig;
  }
  ~FailOver() {
    processes_.clear();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  FailOver(const FailOver&) = delete;
  FailOver& operator=(const FailOver&) = delete;

  std::vector<Round> run() {
    processes_.resize(2);
    start(0);
    start(1);
    gyro_ = std::make_unique<SyntheticGyro>(measuring_,
                                            SyntheticGyroOptions{.rate_hz = options_.rate_hz});
    wait_until([&] { return subscriber_.any(); }, "nothing is answered");
    for (const int instance : {0, 1}) wait_until_in_sync(instance);
    int faulty = 0;
    std::vector<Round> rounds;
    services::ProgressBar bar("fail-over");
    const std::size_t all = options_.faults.size() * static_cast<std::size_t>(options_.rounds);
    for (int r = 0; r < options_.rounds; ++r) {
      for (const auto& fault : options_.faults) {
        rounds.push_back(round(fault, faulty));
        faulty = 1 - faulty;
        bar.show(static_cast<double>(rounds.size()) / static_cast<double>(all));
      }
    }
    return rounds;
  }

 private:
  void start(int instance) {
    instances_.forget(instance);
    std::vector<std::string> arguments{"--domain",
                                       std::to_string(options_.network.domain),
                                       "--instance",
                                       std::to_string(instance),
                                       "--redundant",
                                       "--config",
                                       (folder_ / "config.yaml").string()};
    const auto& security = options_.network.security_dir;
    if (!security.empty()) arguments.insert(arguments.end(), {"--security", security.string()});
    processes_[static_cast<std::size_t>(instance)] = std::make_unique<BenchProcess>(
        "compensation", std::move(arguments), BenchProcess::Streams::kQuiet);
  }
  double metric(int instance, const char* name) { return instances_.metric(instance, name); }

  template <typename Condition>
  void wait_until(Condition condition, const char* otherwise) {
    const auto give_up = Clock::now() + kAwaitedFor;
    while (!condition()) {
      if (service::wait_for_stop(20ms)) throw std::runtime_error("bench fail-over: stopped");
      if (Clock::now() > give_up)
        throw std::runtime_error(std::string("bench fail-over: ") + otherwise);
    }
  }

  // Its answers are the other's, for as long as it takes to compare some.
  void wait_until_in_sync(int instance) {
    double compared = -1.0;
    double differing = -1.0;
    wait_until(
        [&] {
          const bool is_in_sync = metric(instance, "health") == 0.0;
          if (!is_in_sync || compared < 0.0 || metric(instance, "differing") != differing) {
            compared = is_in_sync ? metric(instance, "compared") : -1.0;
            differing = metric(instance, "differing");
          }
          return is_in_sync && metric(instance, "compared") >= compared + kComparedInSync;
        },
        "one instance isn't in sync with the other");
  }

  Round round(const std::string& fault, int faulty) {
    subscriber_.forget();
    std::this_thread::sleep_for(50ms);
    BenchProcess& process = *processes_[static_cast<std::size_t>(faulty)];
    const std::int64_t begin = service::monotonic_ns();
    if (fault == "kill") {
      kill(process.pid(), SIGKILL);
      std::this_thread::sleep_for(kFaultLasts);
      start(faulty);
    } else if (fault == "stop") {
      kill(process.pid(), SIGSTOP);
      std::this_thread::sleep_for(kFaultLasts);
      kill(process.pid(), SIGCONT);
    } else {
      const HangingThread hanging(process.pid(), "learner");
      std::this_thread::sleep_for(kHangLasts);
    }
    const auto ended = Clock::now();
    std::this_thread::sleep_for(kFaultIsOver);
    const std::uint64_t last = gyro_->newest();
    wait_until([&] { return subscriber_.has_seen(last); }, "what was measured isn't answered");
    Round result{.fault = fault,
                 .verdict = subscriber_.judge(
                     begin - 50'000'000, last,
                     begin + (fault == "hang" ? kHangGapWithin : kGapWithin).count())};
    wait_until_in_sync(faulty);
    result.in_sync_after_s = std::chrono::duration<double>(Clock::now() - ended).count();
    const double since = metric(faulty, "differing");
    std::this_thread::sleep_for(500ms);
    result.differing = metric(faulty, "differing") - since;
    return result;
  }

  FailOverOptions options_;
  std::filesystem::path folder_;
  dds::Participant measuring_;  // named as those whose permissions they need with security
  dds::Participant listening_;
  Instances instances_;
  Subscriber subscriber_;
  std::vector<std::unique_ptr<BenchProcess>> processes_;
  std::unique_ptr<SyntheticGyro> gyro_;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

int report(const FailOverOptions& options, const std::vector<Round>& rounds) {
  nlohmann::json json;
  bool good = true;
  std::printf(
      "fail-over at %.0f Hz: gap in periods of %.3g ms (later: while the other comes back), "
      "samples "
      "lost, repeated and out of order at a subscriber\n%-6s %7s %8s %8s %8s %8s %6s %9s %13s %10s "
      "%13s\n",
      options.rate_hz, 1e3 / options.rate_hz, "fault", "rounds", "median", "worst", "allowed",
      "later", "lost", "repeated", "out of order", "differing", "in sync [s]");
  for (const auto& fault : options.faults) {
    std::vector<double> gaps;
    std::vector<double> syncs;
    std::vector<double> later;
    Subscriber::Verdict sum;
    double differing = 0.0;
    for (const Round& round : rounds) {
      if (round.fault != fault) continue;
      gaps.push_back(round.verdict.gap_ms * options.rate_hz * 1e-3);
      syncs.push_back(round.in_sync_after_s);
      later.push_back(round.verdict.later_gap_ms * options.rate_hz * 1e-3);
      sum.lost += round.verdict.lost;
      sum.repeated += round.verdict.repeated;
      sum.out_of_order += round.verdict.out_of_order;
      differing += round.differing;
    }
    const double allowed = fault == "kill" ? kPeriodsKill : kPeriodsStop;
    const double worst = *std::max_element(gaps.begin(), gaps.end());
    const auto over =
        std::count_if(gaps.begin(), gaps.end(), [&](double g) { return g > allowed; });
    good = good && over == 0 && sum.lost + sum.repeated + sum.out_of_order == 0 && differing == 0.0;
    std::printf(
        "%-6s %7zu %8.2f %8.2f %8.0f %8.2f %6llu %9llu %13llu %10.0f %13.2f%s\n", fault.c_str(),
        gaps.size(), median(gaps), worst, allowed, *std::max_element(later.begin(), later.end()),
        static_cast<unsigned long long>(sum.lost), static_cast<unsigned long long>(sum.repeated),
        static_cast<unsigned long long>(sum.out_of_order), differing, median(syncs),
        over > 0 ? ("  " + std::to_string(over) + " gaps too long").c_str() : "");
    json["faults"][fault] = {{"rounds", gaps.size()},      {"gap_periods", gaps},
                             {"allowed_periods", allowed}, {"gaps_too_long", over},
                             {"later_gap_periods", later}, {"lost", sum.lost},
                             {"repeated", sum.repeated},   {"out_of_order", sum.out_of_order},
                             {"differing", differing},     {"in_sync_after_s", syncs}};
  }
  if (!options.json.empty()) {
    json["rate_hz"] = options.rate_hz;
    files::AtomicFile file(options.json);
    file.append(json.dump(2) + "\n");
    file.commit();
  }
  return good ? service::kExitDone : service::kExitNo;
}

}  // namespace

void add_bench_fail_over(CLI::App& bench, Run& run) {
  auto* command = bench.add_subcommand(
      "fail-over",
      "faults of one and the other of two instances, and what a subscriber sees of them");
  auto options = std::make_shared<FailOverOptions>();
  options->network.domain = kDomain;
  command->add_option("--rounds", options->rounds, "of each fault")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command
      ->add_option("--faults", options->faults,
                   "kill (SIGKILL, then started anew), stop (SIGSTOP, then SIGCONT), hang (of the "
                   "learner's thread)")
      ->delimiter(',')
      ->check(CLI::IsMember({"kill", "stop", "hang"}))
      ->capture_default_str();
  command->add_option("--rate", options->rate_hz, "samples a second")
      ->check(CLI::Range(10.0, 5000.0))
      ->capture_default_str();
  const auto schemes = compensation::scheme_names();
  command->add_option("--scheme", options->scheme, "of both instances")
      ->check(CLI::IsMember(std::vector<std::string>(schemes.begin(), schemes.end())))
      ->capture_default_str();
  command->add_option("--json", options->json, "also as JSON, to this file");
  command->add_option("--domain", options->network.domain, "DDS domain")->capture_default_str();
  command->add_option("--security", options->network.security_dir,
                      "folder made by deploy/security/make_certificates.sh");
  command->callback([options, &run] {
    run = [options] {
      std::vector<Round> rounds;
      {
        FailOver fail_over(*options);
        rounds = fail_over.run();
      }
      return report(*options, rounds);
    };
  });
}

}  // namespace zerodrift::bench
