// SPDX-License-Identifier: Apache-2.0
// zerodrift_bench allan: what a streamed sample costs, how much memory it takes however long it
// runs, and the batch deviation beside a straightforward one.
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "common/allan/deviations.h"
#include "common/allan/rolling_allan.h"
#include "common/service/host.h"
#include "common/service/main.h"
#include "tests/bench/bench.h"

namespace zerodrift::bench {
namespace {

constexpr double kSampleInterval_s = 0.005;  // 200 Hz
constexpr double kLongestTau_s = 1e5;
constexpr std::size_t kBatchSamples = 3'600'000;  // 5 h
constexpr std::size_t kPattern = 1 << 16;         // samples that are streamed over and over
constexpr std::size_t kWarmRounds = 16;  // beyond the window of an hour: every pane was touched
constexpr std::uint64_t kSeed = 1;
constexpr double kNoise_radps = 1e-5;
constexpr double kMean_radps = 5e-5;  // some of Earth's rate

struct AllanBenchOptions {
  double samples = 1e7;  // a run
  std::size_t repeats = 5;
};

std::vector<double> noise(std::size_t samples) {
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> normal(kMean_radps, kNoise_radps);
  std::vector<double> rate(samples);
  for (double& y : rate) y = normal(random);
  return rate;
}

// Processor time of this thread: what others do on the machine is not ours.
double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

long resident_kb() {
  std::ifstream pages("/proc/self/statm");
  long total = 0;
  long resident = 0;
  pages >> total >> resident;
  return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

const char* name(allan::TauGrid grid) {
  return grid == allan::TauGrid::kOctave ? "octave" : "quarter octave";
}

struct Bar {
  std::string what;
  double found;
  double at_most;
};

// --- streaming

struct Streamed {
  double nanoseconds = 0.0;  // a sample; median over the runs
  double least = 0.0;
  double most = 0.0;
  std::size_t bytes = 0;
  std::size_t taus = 0;
  long grown_kb = 0;  // resident memory over all runs but the first
  bool is_stopped = false;
};

Streamed stream(allan::TauGrid grid, const AllanBenchOptions& options,
                const std::vector<double>& pattern) {
  allan::RollingAllan rolling(
      {.sample_interval_s = kSampleInterval_s, .grid = grid, .longest_tau_s = kLongestTau_s});
  const auto rounds =
      static_cast<std::uint64_t>(std::ceil(options.samples / static_cast<double>(kPattern)));
  Streamed result{.bytes = rolling.memory_bytes(), .taus = rolling.tau_count()};
  for (std::size_t round = 0; round < kWarmRounds; ++round) {
    for (const double y : pattern) rolling.add(y);
  }
  const long before_kb = resident_kb();
  std::vector<double> runs;
  for (std::size_t run = 0; run < options.repeats; ++run) {
    const double begun_s = processor_s();
    for (std::uint64_t round = 0; round < rounds; ++round) {
      for (const double y : pattern) rolling.add(y);
      if (round % 256 == 0 && service::wait_for_stop(std::chrono::milliseconds(0))) {
        result.is_stopped = true;
        return result;
      }
    }
    runs.push_back(1e9 * (processor_s() - begun_s) /
                   (static_cast<double>(rounds) * static_cast<double>(kPattern)));
  }
  result.grown_kb = resident_kb() - before_kb;
  result.nanoseconds = median(runs);
  result.least = *std::min_element(runs.begin(), runs.end());
  result.most = *std::max_element(runs.begin(), runs.end());
  return result;
}

void print(allan::TauGrid grid, const Streamed& s) {
  std::printf("%-16s%8.1f%8.1f to %.1f%8zu%14.1f%16ld\n", name(grid), s.nanoseconds, s.least,
              s.most, s.taus, static_cast<double>(s.bytes) / 1000.0, s.grown_kb);
  std::fflush(stdout);
}

// --- batch

// As anyone would write it: a cumulative sum, then every second difference, in doubles.
std::vector<double> straightforward(const std::vector<double>& rate,
                                    const std::vector<std::size_t>& sizes) {
  std::vector<double> angle(rate.size() + 1, 0.0);
  for (std::size_t i = 0; i < rate.size(); ++i)
    angle[i + 1] = angle[i] + rate[i] * kSampleInterval_s;
  std::vector<double> deviations;
  for (const std::size_t m : sizes) {
    double sum = 0.0;
    const std::size_t terms = angle.size() - 2 * m;
    for (std::size_t k = 0; k < terms; ++k) {
      const double d = angle[k + 2 * m] - 2.0 * angle[k + m] + angle[k];
      sum += d * d;
    }
    const double tau_s = static_cast<double>(m) * kSampleInterval_s;
    deviations.push_back(std::sqrt(sum / (2.0 * tau_s * tau_s * static_cast<double>(terms))));
  }
  return deviations;
}

std::vector<double> ours(const std::vector<double>& rate, const std::vector<std::size_t>& sizes) {
  const auto angle = allan::angle_from_rate(rate, kSampleInterval_s);
  std::vector<double> deviations;
  for (const std::size_t m : sizes) {
    deviations.push_back(
        allan::deviation(allan::Statistic::kOadev, angle, kSampleInterval_s, m)->deviation);
  }
  return deviations;
}

struct Batch {
  double ours_s = 0.0;  // medians
  double straightforward_s = 0.0;
  double all_of_ours_s = 0.0;  // with noise types, degrees of freedom and bounds
  double largest_difference = 0.0;
  double streamed_difference = 0.0;  // of the cascade where it takes the same differences
  std::size_t taus = 0;
};

template <typename Body>
double timed(Body&& body) {
  const double begun_s = processor_s();
  body();
  return processor_s() - begun_s;
}

double largest_relative_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, std::abs(a[i] / b[i] - 1.0));
  return largest;
}

// The cascade takes every difference up to 16 samples.
double streamed_difference(const std::vector<double>& rate, const std::vector<std::size_t>& sizes,
                           const std::vector<double>& batch) {
  allan::RollingAllan rolling(
      {.sample_interval_s = kSampleInterval_s, .longest_tau_s = kLongestTau_s});
  for (const double y : rate) rolling.add(y);
  double largest = 0.0;
  for (std::size_t i = 0; i < sizes.size() && sizes[i] <= 16; ++i) {
    const auto point = rolling.point(i, allan::Span::kSinceStart);
    largest = std::max(largest, std::abs(point->deviation_radps / batch[i] - 1.0));
  }
  return largest;
}

Batch compare_batch(std::size_t repeats) {
  const std::vector<double> rate = noise(kBatchSamples);
  std::vector<std::size_t> sizes;
  for (const auto& cluster : allan::clusters(allan::TauGrid::kOctave, rate.size() / 2))
    sizes.push_back(static_cast<std::size_t>(cluster.size()));
  Batch batch{.taus = sizes.size()};
  std::vector<double> own, plain, own_s, plain_s, all_s;
  for (std::size_t run = 0; run < repeats; ++run) {
    own_s.push_back(timed([&] { own = ours(rate, sizes); }));
    plain_s.push_back(timed([&] { plain = straightforward(rate, sizes); }));
    all_s.push_back(timed([&] {
      const auto angle = allan::angle_from_rate(rate, kSampleInterval_s);
      static_cast<void>(
          allan::overlapping_allan(angle, kSampleInterval_s, allan::TauGrid::kOctave));
    }));
  }
  batch.ours_s = median(own_s);
  batch.straightforward_s = median(plain_s);
  batch.all_of_ours_s = median(all_s);
  batch.largest_difference = largest_relative_difference(own, plain);
  batch.streamed_difference = streamed_difference(rate, sizes, own);
  return batch;
}

void print(const Batch& batch) {
  std::printf(
      "\nbatch: overlapping deviation of %zu samples at %zu octave taus, medians of processor "
      "time\n"
      "  ours %.3f s, a straightforward cumulative sum in doubles %.3f s: theirs / ours %.2f\n"
      "  ours with noise types, degrees of freedom and bounds %.3f s\n"
      "  largest relative difference between the two %.1e\n"
      "  and of the stream from the batch, where both take every difference, %.1e\n",
      kBatchSamples, batch.taus, batch.ours_s, batch.straightforward_s,
      batch.straightforward_s / batch.ours_s, batch.all_of_ours_s, batch.largest_difference,
      batch.streamed_difference);
}

// True if all are met.
bool print_bars(const std::vector<Bar>& bars) {
  std::printf("\nbars\n");
  bool all_met = true;
  for (const Bar& bar : bars) {
    const bool met = bar.found <= bar.at_most;
    std::printf("  %-48s%12.3g   at most %8.3g   %s\n", bar.what.c_str(), bar.found, bar.at_most,
                met ? "met" : "not met");
    all_met = all_met && met;
  }
  return all_met;
}

int bench_allan(const AllanBenchOptions& options) {
  std::printf(
      "streaming: one axis at 200 Hz, taus to %g s, %g samples a run, %zu runs, medians of "
      "processor time\n"
      "%-16s%8s%16s%8s%14s%16s\n",
      kLongestTau_s, options.samples, options.repeats, "grid", "ns", "least to most", "taus",
      "memory kB", "grown since kB");
  const std::vector<double> pattern = noise(kPattern);
  std::vector<Bar> bars;
  for (const auto grid : {allan::TauGrid::kOctave, allan::TauGrid::kQuarterOctave}) {
    const Streamed streamed = stream(grid, options, pattern);
    if (streamed.is_stopped) return service::kExitNo;
    print(grid, streamed);
    const std::string where = std::string(name(grid)) + ", ";
    bars.push_back({where + "ns a sample and stream", streamed.nanoseconds,
                    grid == allan::TauGrid::kOctave ? 50.0 : 100.0});
    bars.push_back({where + "memory, kB", static_cast<double>(streamed.bytes) / 1000.0, 128.0});
    bars.push_back(
        {where + "resident memory grown, kB", static_cast<double>(streamed.grown_kb), 64.0});
  }
  const Batch batch = compare_batch(options.repeats);
  print(batch);
  bars.push_back(
      {"batch, ours / straightforward, time", batch.ours_s / batch.straightforward_s, 1.5});
  bars.push_back({"batch, relative difference", batch.largest_difference, 1e-6});
  return print_bars(bars) ? service::kExitDone : service::kExitNo;
}

}  // namespace

void add_bench_allan(CLI::App& bench, Run& run) {
  auto* command = bench.add_subcommand("allan", "the streamed and the batch Allan deviation");
  auto options = std::make_shared<AllanBenchOptions>();
  command
      ->add_option("--samples", options->samples,
                   "samples a run; 1e9 shows that nothing grows (a minute or two a run)")
      ->check(CLI::Range(1e5, 1e12))
      ->capture_default_str();
  command->add_option("--repeats", options->repeats, "runs, of which the median counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->callback([options, &run] { run = [options] { return bench_allan(*options); }; });
}

}  // namespace zerodrift::bench
