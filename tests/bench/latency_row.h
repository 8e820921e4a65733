// SPDX-License-Identifier: Apache-2.0
// One way to carry a sample, with its processes, led by the bench.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/service/realtime.h"
#include "tests/bench/bench_process.h"

namespace zerodrift::bench {

enum class Direction : std::uint8_t { kOneWay, kRoundTrip };

// What happened to the samples of a cell of the table.
struct LatencyCell {
  std::vector<double> latencies_us{};  // of those received, in order of sending
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;
  std::uint64_t late = 0;  // took longer than a sample period
};

struct RowOptions {
  std::string kind;   // see LinkOptions
  std::string label;  // for the table
};

struct BenchSetting {
  std::uint32_t domain = 0;
  service::RealtimeOptions realtime{};
  std::size_t capacity = 0;  // samples that a process sends in its life
};

// The processes of a row in one direction. All rows of a run live at the same time and take turns,
// so that what the machine does besides meets all of them alike.
class LatencyRow {
 public:
  // Starts the processes; throws std::runtime_error.
  LatencyRow(const RowOptions& options, Direction direction, const BenchSetting& setting);

  // Until both ends know each other and a sample has come through; throws where none does.
  void connect();
  // From now on each end loses arriving datagrams.
  void lose_datagrams(unsigned permille);
  // Sends for `duration_s` after a short warm-up that does not count, waits until what is repaired
  // has arrived, and adds to the cell.
  void measure(double rate_hz, double duration_s, LatencyCell& cell);

 private:
  [[nodiscard]] std::vector<std::int64_t> received(std::uint64_t first, std::uint64_t last);

  std::string label_;
  std::unique_ptr<BenchProcess> service_;  // the chain's
  std::unique_ptr<BenchProcess> near_;
  std::unique_ptr<BenchProcess> far_;  // none for the chain's round trip
  Direction direction_;
  bool loses_ = false;
};

}  // namespace zerodrift::bench
