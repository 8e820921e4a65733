// SPDX-License-Identifier: Apache-2.0
// zerodrift_bench record: many gyros at a high rate into a recorder, through the middleware and
// onto the disk, and what of it is in the file.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/core/one_line.h"
#include "common/report/json_file.h"
#include "common/service/host.h"
#include "common/service/main.h"
#include "services/zerodrift/info_mcap.h"
#include "tests/bench/bench.h"
#include "tests/bench/bench_latency.h"
#include "tests/bench/bench_process.h"

namespace zerodrift::bench {
namespace {

using namespace std::chrono_literals;

struct BenchOptions {
  std::uint32_t domain = kBenchDomain;
  std::uint32_t gyros = 10;
  double rate_hz = 2000.0;
  double duration_s = 10.0;
  std::string compression = "zstd";
  std::string folder = "/tmp";
  std::string json{};
};

struct Figures {
  std::uint64_t sent = 0;     // by all gyros
  std::uint64_t refused = 0;  // by the publisher's middleware
  std::uint64_t recorded = 0;
  double elapsed_s = 0.0;
  double recorder_cpu = 0.0;  // % of a core
  double publisher_cpu = 0.0;
  std::int64_t recorder_kb = 0;
  services::McapSummary file{};

  [[nodiscard]] std::uint64_t lost() const { return sent > recorded ? sent - recorded : 0; }
  [[nodiscard]] double payload_bytes() const {
    double bytes = 0.0;
    for (const auto& channel : file.channels) bytes += static_cast<double>(channel.bytes);
    return bytes;
  }
  [[nodiscard]] std::string_view figure(std::string_view key) const {
    for (const auto& metadata : file.metadata) {
      if (metadata.name == "recording") return mcap::value_of(metadata.values, key);
    }
    return "";
  }
};

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", value);
  return buffer;
}

// The recorder ends on SIGTERM, which ~BenchProcess sends; its file then has its name.
void wait_for_file(const std::filesystem::path& file) {
  for (int tenth = 0; tenth < 100; ++tenth) {
    if (std::filesystem::exists(file)) return;
    std::this_thread::sleep_for(100ms);
  }
  throw std::runtime_error("bench record: the recorder did not finish " + file.string());
}

Figures measure(const BenchOptions& options, const std::filesystem::path& file) {
  Figures figures;
  const std::string domain = std::to_string(options.domain);
  BenchProcess fleet("zerodrift_bench",
                     {"gyro-fleet", "--gyros", std::to_string(options.gyros), "--domain", domain},
                     BenchProcess::Streams::kTalks);
  {
    BenchProcess recorder(
        "zerodrift",
        {"record", "--out", file, "--domain", domain, "--compression", options.compression},
        BenchProcess::Streams::kTalks);  // its last words are not ours
    const auto until = std::chrono::steady_clock::now() + 20s;
    do {
      if (std::chrono::steady_clock::now() > until)
        throw std::runtime_error("bench record: the recorder is not heard of within 20 s");
      std::this_thread::sleep_for(20ms);
      fleet.say("ready");
    } while (fleet.receive(5000ms) != "yes");
    std::this_thread::sleep_for(500ms);  // matched here is matched there a little later

    const double recorder_s = recorder.usage().cpu_s;
    const double fleet_s = fleet.usage().cpu_s;
    const auto count = static_cast<std::uint64_t>(options.rate_hz * options.duration_s + 0.5);
    const auto start = std::chrono::steady_clock::now();
    fleet.say("send " + text(options.rate_hz) + ' ' + std::to_string(count));
    std::istringstream answer(fleet.receive(std::chrono::milliseconds(
        static_cast<std::int64_t>(20000.0 + 5000.0 * options.duration_s))));
    std::uint64_t newest = 0;
    answer >> newest >> figures.refused;
    figures.elapsed_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::this_thread::sleep_for(1s);  // what is under way arrives, or never does
    figures.sent = newest * options.gyros;
    figures.recorder_cpu = 100.0 * (recorder.usage().cpu_s - recorder_s) / figures.elapsed_s;
    figures.publisher_cpu = 100.0 * (fleet.usage().cpu_s - fleet_s) / figures.elapsed_s;
    figures.recorder_kb = recorder.usage().resident_kb;
  }
  wait_for_file(file);
  figures.file = services::summarise(file);
  for (const auto& channel : figures.file.channels) {
    if (channel.topic == dds::kAngularRate.name) figures.recorded += channel.messages;
  }
  return figures;
}

int bench_record(const BenchOptions& options) {
  const auto folder = std::filesystem::path(options.folder) /
                      ("zerodrift-bench-record-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const Figures figures = [&] {
    try {
      Figures measured = measure(options, folder / "bench.mcap");
      std::filesystem::remove_all(folder);
      return measured;
    } catch (...) {
      std::filesystem::remove_all(folder);
      throw;
    }
  }();
  const double seconds = figures.elapsed_s;
  std::printf(
      "%u gyros at %g Hz for %.1f s: %llu samples sent, %llu recorded, %llu lost\n"
      "%.0f samples/s, %.2f MB/s of payload, %.2f MB/s onto the disk (%s, %.2f to 1)\n"
      "CPU of the recorder %.1f %% of a core, of the publisher %.1f %%; the recorder's memory %.1f "
      "MB\n"
      "arrival to writer p99 %s us, largest %s us; a chunk compressed and handed to the system: "
      "p99 "
      "%s us, largest %s us; at most %s bytes waited\n",
      options.gyros, options.rate_hz, seconds, static_cast<unsigned long long>(figures.sent),
      static_cast<unsigned long long>(figures.recorded),
      static_cast<unsigned long long>(figures.lost()), static_cast<double>(figures.sent) / seconds,
      1e-6 * figures.payload_bytes() / seconds,
      1e-6 * static_cast<double>(figures.file.bytes) / seconds, options.compression.c_str(),
      figures.file.compression_ratio, figures.recorder_cpu, figures.publisher_cpu,
      1e-3 * static_cast<double>(figures.recorder_kb),
      std::string(figures.figure("queue_delay_p99_us")).c_str(),
      std::string(figures.figure("queue_delay_max_us")).c_str(),
      std::string(figures.figure("chunk_write_p99_us")).c_str(),
      std::string(figures.figure("chunk_write_max_us")).c_str(),
      std::string(figures.figure("queue_peak_bytes")).c_str());
  // The figures are then of a lower rate than was asked for.
  constexpr double kKept = 0.95;
  const double wanted_s = options.duration_s;
  if (wanted_s < kKept * seconds) {
    std::printf("the publisher did not keep the rate: %.1f s of samples took it %.1f s\n", wanted_s,
                seconds);
  }
  if (!options.json.empty()) {
    report::write_json(options.json,
                       {{"gyros", options.gyros},
                        {"rate_hz", options.rate_hz},
                        {"elapsed_s", seconds},
                        {"sent", figures.sent},
                        {"recorded", figures.recorded},
                        {"lost", figures.lost()},
                        {"payload_bytes", figures.payload_bytes()},
                        {"file_bytes", figures.file.bytes},
                        {"compression_ratio", figures.file.compression_ratio},
                        {"recorder_cpu_percent", figures.recorder_cpu},
                        {"publisher_cpu_percent", figures.publisher_cpu},
                        {"recorder_resident_kb", figures.recorder_kb},
                        {"queue_delay_p99_us", std::string(figures.figure("queue_delay_p99_us"))},
                        {"chunk_write_p99_us", std::string(figures.figure("chunk_write_p99_us"))}});
  }
  return figures.lost() == 0 && figures.refused == 0 ? service::kExitDone : service::kExitNo;
}

}  // namespace

void add_bench_record(CLI::App& bench, Run& run) {
  auto* command = bench.add_subcommand("record", "many gyros into a recording, none lost");
  auto options = std::make_shared<BenchOptions>();
  command->add_option("--gyros", options->gyros, "how many")
      ->check(CLI::Range(1, 120))
      ->capture_default_str();
  command->add_option("--rate", options->rate_hz, "of each, Hz")
      ->check(CLI::Range(1.0, 20000.0))
      ->capture_default_str();
  command->add_option("--duration", options->duration_s, "s")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->add_option("--compression", options->compression, "zstd, lz4 or none")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}))
      ->capture_default_str();
  command->add_option("--folder", options->folder, "where the file goes, and is removed again")
      ->capture_default_str();
  command->add_option("--json", options->json, "file for the figures");
  command->add_option("--domain", options->domain, "DDS domain")->capture_default_str();
  command->callback([options, &run] { run = [options] { return bench_record(*options); }; });
}

}  // namespace zerodrift::bench
