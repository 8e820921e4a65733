// SPDX-License-Identifier: Apache-2.0
#include "common/recording/disk_writer.h"

#include <exception>
#include <optional>
#include <utility>

#include "common/service/monotonic_clock.h"

namespace zerodrift::recording {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;
constexpr std::int64_t kFlushEveryNs = kSecondNs;     // at most so much is lost with the process
constexpr std::int64_t kSyncEveryNs = 5 * kSecondNs;  // and with the machine
constexpr std::int64_t kRetryEveryNs = kSecondNs;     // a disk that refused

}  // namespace

DiskWriter::DiskWriter(const DiskWriterOptions& options,
                       std::function<void(const std::string&)> report_refusal, Describe describe)
    : options_(options),
      report_refusal_(std::move(report_refusal)),
      describe_(std::move(describe)),
      file_(options.file),
      pre_trigger_(options.pre_trigger_s, options.pre_trigger_bytes) {}

void DiskWriter::take(MessageBatch& batch, std::int64_t now_ns) {
  if (options_.pre_trigger_s > 0.0) {
    watch_for_trigger(batch, now_ns);
  } else {
    write(batch);
  }
}

void DiskWriter::finish() {
  guarded([this] { finish_file(); });
}

void DiskWriter::write(const MessageBatch& batch) {
  std::size_t position = 0;
  for (QueuedMessage message; batch.next(position, message);) write(message);
}

void DiskWriter::write(const QueuedMessage& message) {
  if (!is_recorded(message.role)) return;
  ++taken_;
  if (is_refused_) {  // the open chunk waits for the disk; it must not grow without end
    count();
    return;
  }
  if (file_.was_cut()) refused_before_ = unwritten_;
  const std::int64_t now_ns = service::monotonic_ns();
  queue_delay_.record_between(message.arrival_ns, now_ns);
  guarded([&] {
    const std::uint64_t before = file_.bytes();
    file_.write(message);
    if (file_.bytes() != before) {
      chunk_delay_.record_between(now_ns, service::monotonic_ns());
      flushed_ns_ = now_ns;
    }
    if (file_.is_due_to_split(message.arrival_ns)) finish_file();
  });
}

void DiskWriter::count() noexcept {
  bytes_ = file_.bytes();
  messages_ = file_.messages();
  unwritten_ = taken_ - file_.messages() - file_.waiting();
}

void DiskWriter::watch_for_trigger(MessageBatch& batch, std::int64_t now_ns) {
  std::optional<std::int64_t> first;
  std::size_t position = 0;
  for (QueuedMessage message; batch.next(position, message);) {
    if (message.role != MessageRole::kTrigger) continue;
    if (!first) first = message.arrival_ns;
    recorded_until_ns_ =
        message.arrival_ns + static_cast<std::int64_t>(1e9 * options_.post_trigger_s);
  }
  if (is_triggered_) {
    write(batch);
  } else {
    pre_trigger_.keep(std::move(batch), now_ns);
    batch = {};
    if (!first) return;
    ++triggers_;
    is_triggered_ = true;
    pre_trigger_.give_out(*first, [this](const QueuedMessage& message) { write(message); });
  }
  if (now_ns < recorded_until_ns_) return;
  is_triggered_ = false;
  guarded([this] { finish_file(); });
}

void DiskWriter::look_after_disk(std::int64_t now_ns) {
  if (is_refused_ && now_ns < retry_ns_) return;
  if (is_refused_ || now_ns - flushed_ns_ >= kFlushEveryNs) {
    flushed_ns_ = now_ns;
    const bool is_sync_due = now_ns - synced_ns_ >= kSyncEveryNs;
    if (is_sync_due) synced_ns_ = now_ns;
    guarded([&] {
      file_.flush(is_sync_due ? RecordFile::Durability::kMedium : RecordFile::Durability::kProcess);
      chunk_delay_.record_between(now_ns, service::monotonic_ns());
      is_refused_ = false;
    });
  }
}

void DiskWriter::guarded(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    failed_ = true;
    is_refused_ = true;
    retry_ns_ = service::monotonic_ns() + kRetryEveryNs;
    report_refusal_(error.what());
  }
  count();
}

void DiskWriter::finish_file() {
  if (!file_.is_open()) return;
  count();
  mcap::Pairs more = describe_(unwritten_ - refused_before_);
  const auto us = [](std::int64_t ns) { return std::to_string(ns / 1000); };
  more.emplace_back("queue_delay_p99_us", us(queue_delay_.percentile_ns(0.99)));
  more.emplace_back("queue_delay_max_us", us(queue_delay_.max_ns()));
  more.emplace_back("chunk_write_p99_us", us(chunk_delay_.percentile_ns(0.99)));
  more.emplace_back("chunk_write_max_us", us(chunk_delay_.max_ns()));
  if (options_.pre_trigger_s > 0.0) {
    more.emplace_back("trigger", std::to_string(triggers_));
    if (pre_trigger_.is_shortened()) more.emplace_back("pre_trigger_shortened", "yes");
  }
  file_.finish(more);
  refused_before_ = unwritten_;
}

}  // namespace zerodrift::recording
