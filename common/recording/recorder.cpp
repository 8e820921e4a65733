// SPDX-License-Identifier: Apache-2.0
#include "common/recording/recorder.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "common/core/bounded_table.h"
#include "common/core/counted.h"
#include "common/dds/raw_reader.h"
#include "common/recording/arrival_count.h"
#include "common/recording/discovery_complete.h"
#include "common/recording/record_queue.h"
#include "common/recording/recorded_topics.h"
#include "common/service/host.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/service/replay_pacer.h"

namespace zerodrift::recording {
namespace {

using namespace std::chrono_literals;

constexpr auto kLongestWait = 50ms;
// A source begins when its consumers have announced themselves: this one once its discovery has
// complete, that is when the writers know of it as well.
constexpr const char* kConsumer = "recorder";

constexpr std::uint32_t kRateTopic = topic_index<msg::AngularRate>();
constexpr std::uint32_t kCompensatedIndex = topic_index<msg::CompensatedRate>();

bool records(const McapRecordOptions& options, std::string_view topic) {
  const auto& wanted = options.topics;
  return wanted.empty() || std::find(wanted.begin(), wanted.end(), topic) != wanted.end();
}

// A replay waits for who is named, whatever of it is recorded: without rates or answers of it in
// the file the rates are heard for that alone.
bool hears_rates_for_pace(const McapRecordOptions& options) {
  return !records(options, dds::kAngularRate.name) && !records(options, dds::kCompensatedRate.name);
}

class McapRecorder {
 public:
  explicit McapRecorder(const McapRecordOptions& options)
      : options_(options),
        disk_(
            options.disk, [this](const std::string& why) { report_refusal(why); },
            [this](std::uint64_t refused) { return description(refused); }),
        queue_(options.queue_bytes),
        host_("recorder", options.network),
        participant_("recorder_data", options.network),
        writer_([this] { write_until_closed(); }) {
    const auto& moved_aside = disk_.file().moved_aside();
    if (!moved_aside.empty()) {
      std::fprintf(stderr, "%s: of a recording that was not finished\n", moved_aside.c_str());
    }
    try {
      if (options_.disk.pre_trigger_s > 0.0) {
        triggers_of_.emplace(
            participant_, kNewEvents,
            [this](const msg::Event& event, dds::Bytes, const dds::WireOrigin&) {
              note_trigger(event);
            },
            host_.observer());
      }
      listen(std::make_index_sequence<std::tuple_size_v<dds::AllMessages>>{});
    } catch (...) {
      end_writer();
      throw;
    }
  }
  ~McapRecorder() { end_writer(); }
  McapRecorder(const McapRecorder&) = delete;
  McapRecorder& operator=(const McapRecorder&) = delete;

  int run() {
    host_.run([this] { return status(); }, [this] { tick(); });
    // What was received is written; what comes from here on is not asked for.
    end_writer();
    report();
    const bool is_complete = lost() == 0 && !disk_.has_failed() &&
                             (options_.samples == 0 || compensated_ >= options_.samples);
    const int exit_code = is_complete ? service::kExitDone : service::kExitNo;
    service::end_within(service::kStopWithin, exit_code);
    return exit_code;
  }

 private:
  template <std::size_t... Index>
  void listen(std::index_sequence<Index...>) {
    (listen_to<std::tuple_element_t<Index, dds::AllMessages>>(), ...);
  }

  template <typename Message>
  void listen_to() {
    const std::string_view name = dds::TopicOf<Message>::kSpec.name;
    const bool is_recorded = records(options_, name);
    const bool is_for_pace =
        std::is_same_v<Message, msg::AngularRate> && hears_rates_for_pace(options_);
    if (!is_recorded && !is_for_pace) return;
    auto reader = std::make_shared<dds::RawReader<Message>>(
        participant_,
        [this, is_recorded](const Message& message, dds::Bytes payload,
                            const dds::WireOrigin& origin) {
          is_recorded ? take(message, payload, origin) : keep_pace(message);
        },
        host_.observer(),
        [this](const ArrivalCount::Writer& writer) {
          arrivals_[topic_index<Message>()].note_matched(writer);
        });
    matched_.emplace_back(name, [reader] { return reader->matched(); });
  }

  // ---------------------------------------- the middleware's threads

  template <typename Message>
  void take(const Message& message, dds::Bytes payload, const dds::WireOrigin& origin) {
    count_arrival(message, origin);
    if (origin.is_repeat) return;
    QueuedMessage queued{.topic = topic_index<Message>(),
                         .log_ns = service::unix_time_ns(),
                         .arrival_ns = service::monotonic_ns(),
                         .role = pace_of(message),
                         .payload = {payload.data(), payload.size()}};
    if constexpr (requires { message.gyro_id(); }) queued.gyro_id = message.gyro_id();
    if (options_.gyro_id != 0 && queued.gyro_id != 0 && queued.gyro_id != options_.gyro_id)
      return keep_pace(message);
    if constexpr (requires { message.sequence_number(); })
      queued.sequence = message.sequence_number();
    // An epoch before 1970 doesn't fit MCAP's unsigned time; the payload has it all the same.
    queued.publish_ns = queued.log_ns;
    if constexpr (requires { message.sensor_time_ns(); }) {
      if (message.sensor_time_ns() > 0) queued.publish_ns = message.sensor_time_ns();
    }
    if constexpr (requires { message.probe(); }) queued.part = message.probe().c_str();
    queue_.push(queued);
    if constexpr (std::is_same_v<Message, msg::CompensatedRate>) {
      if (++compensated_ == options_.samples) service::request_stop();
    }
  }

  // With a message that is not recorded, behind those that are.
  template <typename Message>
  void keep_pace(const Message& message) {
    if constexpr (requires {
                    message.sensor_time_ns();
                    message.sequence_number();
                  }) {
      if (pace_of(message) != MessageRole::kPaced) return;
      queue_.push({.topic = topic_index<Message>(),
                   .gyro_id = message.gyro_id(),
                   .sequence = message.sequence_number(),
                   .arrival_ns = service::monotonic_ns(),
                   .publish_ns = message.sensor_time_ns(),
                   .role = MessageRole::kPacedOnly});
    }
  }

  template <typename Message>
  void count_arrival(const Message& message, const dds::WireOrigin& origin) {
    ArrivalCount& arrivals = arrivals_[topic_index<Message>()];
    if constexpr (std::is_same_v<Message, msg::CompensatedRate>) {
      arrivals.note_answer(
          origin.writer, origin.number,
          {message.gyro_id(), message.run_id(), message.sequence_number(), origin.is_repeat});
    } else if constexpr (loses_nothing(dds::TopicOf<Message>::kSpec)) {
      arrivals.note(origin.writer, origin.number);
    }
  }

  void note_trigger(const msg::Event& event) {
    if (is_trigger(event))
      queue_.push({.arrival_ns = service::monotonic_ns(), .role = MessageRole::kTrigger});
  }

  // Of itself the recorder reports without any need to be recorded.
  [[nodiscard]] bool is_trigger(const msg::Event& event) const {
    if (event.service() == host_.name().c_str()) return false;
    if (!options_.trigger.empty()) return options_.trigger == event.code().c_str();
    return event.severity() >= static_cast<std::uint32_t>(service::Severity::kWarning);
  }

  // ---------------------------------------- the writer's thread

  void write_until_closed() {
    MessageBatch batch;
    while (queue_.take(batch, kLongestWait)) {
      const std::int64_t now_ns = service::monotonic_ns();
      note_progress(batch);
      disk_.take(batch, now_ns);
      report_progress();
      disk_.look_after_disk(now_ns);
    }
    disk_.finish();
  }

  void report_refusal(const std::string& why) {
    host_.raise({.code = "recording_failed",
                 .severity = service::Severity::kError,
                 .text = why,
                 .gyro_id = 0,
                 .sensor_time_ns = 0});
  }

  // For a file that ends: what was lost since the one before it did.
  [[nodiscard]] mcap::Pairs description(std::uint64_t refused_by_disk) {
    std::uint64_t lost = refused_by_disk;
    mcap::Pairs of_topics;
    for (std::size_t i = 0; i < dds::kAllTopics.size(); ++i) {
      // A hole may be filled later, so the sum may shrink.
      const std::uint64_t before = lost_before_[i];
      lost_before_[i] = std::max(before, queue_.dropped(i) + arrivals_[i].missing());
      const std::uint64_t count = lost_before_[i] - before;
      if (count == 0) continue;
      lost += count;
      of_topics.emplace_back("messages_lost/" + std::string(dds::kAllTopics[i].name),
                             std::to_string(count));
    }
    mcap::Pairs more{{"messages_lost", std::to_string(lost)}};
    more.insert(more.end(), of_topics.begin(), of_topics.end());
    more.emplace_back("queue_peak_bytes", std::to_string(queue_.peak_bytes()));
    return more;
  }

  // A replay goes on once what it sent is out of the queue: then none of it can be lost. Its
  // temperatures go on with the rates, as where a compensation needs them.
  void note_progress(const MessageBatch& batch) {
    std::size_t position = 0;
    for (QueuedMessage message; batch.next(position, message);) {
      if (!is_paced(message.role)) continue;
      Progress* known = progress_of_.find_or_make(message.gyro_id);
      if (known == nullptr) continue;
      Progress& gyro = *known;
      const bool is_answer = message.topic == kCompensatedIndex;
      if (is_answer || !gyro.is_answered)
        gyro = {message.sequence, core::SensorTime{message.publish_ns}, is_answer};
    }
  }

  void report_progress() {
    const std::lock_guard lock(progress_mutex_);
    if (!progress_) return;
    for (const auto& [gyro_id, progress] : progress_of_.entries())
      progress_->report(gyro_id, progress.newest, progress.time);
  }

  void end_writer() {
    queue_.close();
    if (writer_.joinable()) writer_.join();
  }

  // ---------------------------------------- the status thread

  void tick() {
    begin_once_discovered();
    const auto now = service::monotonic_ns();
    if (has_begun_ && options_.duration_s > 0.0 &&
        static_cast<double>(now - began_ns_) >= 1e9 * options_.duration_s)
      service::request_stop();
    const std::uint64_t dropped = queue_.dropped();
    host_.raise_counted({.code = "recording_overrun",
                         .severity = service::Severity::kWarning,
                         .text = "the disk is slower than what comes; messages are not recorded",
                         .gyro_id = 0,
                         .sensor_time_ns = 0},
                        dropped - reported_dropped_);
    reported_dropped_ = dropped;
    // A hole may be filled by another instance's answers, so the sum may shrink.
    const std::uint64_t missed = std::max(not_arrived(), reported_missed_);
    host_.raise_counted({.code = "recording_incomplete",
                         .severity = service::Severity::kWarning,
                         .text = kDidNotArrive,
                         .gyro_id = 0,
                         .sensor_time_ns = 0},
                        missed - reported_missed_);
    reported_missed_ = missed;
  }

  // Says that it records once it is matched with whoever is there; announces itself to replays once
  // that holds for a writer of rates.
  void begin_once_discovered() {
    const std::lock_guard lock(progress_mutex_);
    if (progress_) return;
    int rates = 0;
    int all = 0;
    for (const auto& [name, matched] : matched_) {
      const int count = matched();
      all += count;
      if (name == dds::kAllTopics[kRateTopic].name) rates = count;
    }
    const std::int64_t now = service::monotonic_ns();
    if (!discovery_.note(participant_.acquaintance(), all, now)) return;
    if (!has_begun_) {
      began_ns_ = now;
      for (ArrivalCount& arrivals : arrivals_) arrivals.begin();
      has_begun_ = true;
      std::printf("recording to %s\n", options_.disk.file.out.c_str());
      std::fflush(stdout);
    }
    const bool hears_rates =
        records(options_, dds::kAngularRate.name) || hears_rates_for_pace(options_);
    if (rates > 0 || !hears_rates)
      progress_ = std::make_unique<service::ReplayProgressReporter>(host_.participant(), kConsumer);
  }

  [[nodiscard]] std::uint64_t not_arrived() const {
    std::uint64_t all = 0;
    for (const ArrivalCount& arrivals : arrivals_) all += arrivals.missing();
    return all;
  }
  [[nodiscard]] std::uint64_t lost() const {
    return queue_.dropped() + disk_.unwritten() + not_arrived();
  }

  service::Status status() {
    const auto us = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-3; };
    return {.state = disk_.has_failed()     ? service::State::kDegraded
                     : disk_.messages() > 0 ? service::State::kRunning
                                            : service::State::kWaiting,
            .summary = core::counted(disk_.messages(), "message") + " recorded",
            .metrics = {{"messages", "1", static_cast<double>(disk_.messages())},
                        {"samples", "1", static_cast<double>(compensated_)},
                        {"messages_lost", "1", static_cast<double>(lost())},
                        {"bytes", "B", static_cast<double>(disk_.bytes())},
                        {"queue_peak", "B", static_cast<double>(queue_.peak_bytes())},
                        {"queue_delay_p99", "us", us(disk_.queue_delay().percentile_ns(0.99))},
                        {"chunk_write_p99", "us", us(disk_.chunk_delay().percentile_ns(0.99))}}};
  }

  void report() const {
    for (const auto& path : disk_.file().files()) {
      std::printf(
          "%s%s\n", path.c_str(),
          path.extension() == ".active" ? ": not finished, readable as far as it goes" : "");
    }
    const auto count = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };
    std::printf("%llu messages, %.1f MB, %llu lost\n", count(disk_.file().messages()),
                static_cast<double>(disk_.file().bytes()) * 1e-6, count(lost()));
    if (lost() == 0) return;
    std::printf(
        "lost: %llu did not arrive, %llu found no room while the disk was slow, %llu were "
        "refused by the disk\n",
        count(not_arrived()), count(queue_.dropped()), count(disk_.unwritten()));
    for (std::size_t i = 0; i < arrivals_.size(); ++i) {
      if (arrivals_[i].missing() == 0) continue;
      std::printf("  %s: %llu did not arrive\n", std::string(dds::kAllTopics[i].name).c_str(),
                  count(arrivals_[i].missing()));
    }
  }

  struct Progress {
    std::uint64_t newest = 0;
    core::SensorTime time{core::kNever};  // of the newest
    bool is_answered = false;             // by compensated_rate, which then counts
  };

  McapRecordOptions options_;
  DiskWriter disk_;  // the writer's
  RecordQueue queue_;
  core::BoundedTable<std::uint32_t, Progress> progress_of_{256};
  std::atomic<std::uint64_t> compensated_{0};

  service::Host host_;
  dds::Participant participant_;
  std::array<ArrivalCount, dds::kAllTopics.size()> arrivals_;
  std::array<std::uint64_t, dds::kAllTopics.size()> lost_before_{};  // the open file
  std::mutex progress_mutex_;
  std::unique_ptr<service::ReplayProgressReporter> progress_;
  bool has_begun_ = false;
  std::int64_t began_ns_ = 0;
  DiscoveryComplete discovery_;
  std::uint64_t reported_dropped_ = 0;
  std::uint64_t reported_missed_ = 0;
  std::thread writer_;
  // Last, so that nothing arrives any more when the rest goes. They own the readers.
  std::optional<dds::RawReader<msg::Event>> triggers_of_;
  std::vector<std::pair<std::string_view, std::function<int()>>> matched_;
};

void check(const McapRecordOptions& options) {
  for (const auto& topic : options.topics) {
    const bool is_known =
        std::any_of(dds::kAllTopics.begin(), dds::kAllTopics.end(),
                    [&](const dds::TopicSpec& spec) { return spec.name == topic; });
    if (is_known) continue;
    std::string names;
    for (const auto& spec : dds::kAllTopics)
      names += (names.empty() ? "" : ", ") + std::string(spec.name);
    throw std::invalid_argument("--topics: found '" + topic + "', expected some of " + names);
  }
  if (options.samples > 0 && !records(options, dds::kCompensatedRate.name))
    throw std::invalid_argument("--samples: counts compensated_rate, which --topics leaves out");
}

}  // namespace

int record_mcap(const McapRecordOptions& options) {
  check(options);
  return McapRecorder(options).run();
}

}  // namespace zerodrift::recording
