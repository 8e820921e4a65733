// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/latency_row.h"

#include <unistd.h>

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace zerodrift::bench {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kWarmUp = 20;  // samples of a turn that don't count: caches, cores asleep
constexpr auto kConnectWithin = 15000ms;
constexpr auto kAnswerWithin = 10000ms;
constexpr auto kOnTheWay = 20ms;      // what was sent has arrived
constexpr auto kUnderRepair = 400ms;  // ... although datagrams are lost

// The same for all of a row's processes, apart from those of every other row of this bench.
std::string link_name(const RowOptions& options, Direction direction) {
  if (options.kind == "chain") return direction == Direction::kOneWay ? "1" : "2";  // gyro's id
  std::string kind = options.kind;
  std::replace(kind.begin(), kind.end(), '-', '_');
  return "bench_" + std::to_string(getpid()) + '_' + kind +
         (direction == Direction::kOneWay ? "_1" : "_2");
}

// The same options as arguments of another program that has them; empty unless wanted.
std::vector<std::string> realtime_arguments(const service::RealtimeOptions& options) {
  if (!options.wanted) return {};
  std::vector<std::string> arguments{"--realtime", "--realtime-priority",
                                     std::to_string(options.priority)};
  if (options.cores.empty()) return arguments;
  std::string cores;
  for (const int core : options.cores) cores += (cores.empty() ? "" : ",") + std::to_string(core);
  arguments.insert(arguments.end(), {"--cores", cores});
  return arguments;
}

std::vector<std::string> end_arguments(const RowOptions& options, Direction direction,
                                       const std::string& end, const BenchSetting& setting) {
  std::vector<std::string> arguments{"latency-end",
                                     "--kind",
                                     options.kind,
                                     "--end",
                                     end,
                                     "--name",
                                     link_name(options, direction),
                                     "--domain",
                                     std::to_string(setting.domain),
                                     "--capacity",
                                     std::to_string(setting.capacity)};
  for (auto& argument : realtime_arguments(setting.realtime)) {
    arguments.push_back(std::move(argument));
  }
  return arguments;
}

}  // namespace

LatencyRow::LatencyRow(const RowOptions& options, Direction direction, const BenchSetting& setting)
    : label_(options.label), direction_(direction) {
  const auto end = [&](const std::string& name) {
    return std::make_unique<BenchProcess>("zerodrift_bench",
                                          end_arguments(options, direction, name, setting),
                                          BenchProcess::Streams::kTalks);
  };
  if (options.kind == "chain") {
    auto arguments = realtime_arguments(setting.realtime);
    arguments.insert(arguments.end(), {"--domain", std::to_string(setting.domain)});
    service_ =
        std::make_unique<BenchProcess>("compensation", arguments, BenchProcess::Streams::kQuiet);
    if (direction == Direction::kRoundTrip) {
      near_ = end("loop");
      return;
    }
  }
  near_ = end("near");
  far_ = end("far");
}

void LatencyRow::connect() {
  const auto until = std::chrono::steady_clock::now() + kConnectWithin;
  const auto still = [&] {
    if (std::chrono::steady_clock::now() < until) return true;
    throw std::runtime_error("bench latency: the two ends of '" + label_ +
                             "' don't find each other within 15 s");
  };
  const auto connected = [](BenchProcess& process) {
    process.say("connected");
    return process.receive(kAnswerWithin) == "yes";
  };
  for (;;) {
    const bool near = connected(*near_);
    const bool far = far_ == nullptr || connected(*far_);
    if (near && far) break;
    still();
    std::this_thread::sleep_for(20ms);
  }
  if (far_ != nullptr && direction_ == Direction::kRoundTrip) {
    far_->say("answer on");
    far_->receive(kAnswerWithin);
  }
  // The chain answers a new gyro only after a moment.
  do {
    still();
    near_->say("send 100 2");
    std::uint64_t first = 0;
    std::uint64_t last = 0;
    std::istringstream(near_->receive(kAnswerWithin)) >> first >> last;
    std::this_thread::sleep_for(kOnTheWay);
    if (received(last, last).front() >= 0) return;
  } while (true);
}

void LatencyRow::lose_datagrams(unsigned permille) {
  loses_ = true;
  for (auto* process : {near_.get(), far_.get()}) {
    if (process == nullptr) continue;
    process->say("lose " + std::to_string(permille));
    process->receive(kAnswerWithin);
  }
}

std::vector<std::int64_t> LatencyRow::received(std::uint64_t first, std::uint64_t last) {
  // A one-way sample's latency is known where it arrives, a round trip's where it started.
  BenchProcess& process = direction_ == Direction::kOneWay ? *far_ : *near_;
  process.say("received " + std::to_string(first) + ' ' + std::to_string(last));
  std::istringstream numbers(process.receive(kAnswerWithin));
  std::uint64_t duplicates = 0;
  numbers >> duplicates;
  std::vector<std::int64_t> latencies_ns;
  for (std::int64_t latency_ns = 0; numbers >> latency_ns;) latencies_ns.push_back(latency_ns);
  if (latencies_ns.size() != last - first + 1) {
    throw std::runtime_error("bench latency: '" + label_ + "' gave an answer of wrong length");
  }
  return latencies_ns;
}

void LatencyRow::measure(double rate_hz, double duration_s, LatencyCell& cell) {
  const auto count =
      std::max<std::uint64_t>(1, static_cast<std::uint64_t>(rate_hz * duration_s + 0.5));
  std::ostringstream order;
  order << "send " << rate_hz << ' ' << count + kWarmUp;
  near_->say(order.str());
  const auto sending_ms =
      static_cast<std::int64_t>(1e3 * static_cast<double>(count + kWarmUp) / rate_hz);
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::istringstream(near_->receive(kAnswerWithin + std::chrono::milliseconds(sending_ms))) >>
      first >> last;
  std::this_thread::sleep_for(loses_ ? kUnderRepair : kOnTheWay);
  const double period_us = 1e6 / rate_hz;
  for (const std::int64_t latency_ns : received(first + kWarmUp, last)) {
    ++cell.sent;
    if (latency_ns < 0) {
      ++cell.lost;
      continue;
    }
    const double latency_us = 1e-3 * static_cast<double>(latency_ns);
    cell.latencies_us.push_back(latency_us);
    if (latency_us > period_us) ++cell.late;
  }
}

}  // namespace zerodrift::bench
