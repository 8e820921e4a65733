// SPDX-License-Identifier: Apache-2.0
// The MCAP files of one recording: what is in each of them beside the messages, and where one ends
// and the next begins.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "common/mcap/log_file.h"
#include "common/mcap/mcap_writer.h"
#include "common/recording/record_queue.h"

namespace zerodrift::recording {

enum class Opening : std::uint8_t { kAtOnce, kWithTheFirstMessage };

struct RecordFileOptions {
  std::filesystem::path out{};
  mcap::WriterOptions writer{};
  std::uint64_t split_bytes = 0;  // 0: never
  std::int64_t split_ns = 0;      // by arrival; 0: never
  bool is_numbered = false;       // <stem>_0001.mcap, ...: there may be several
  Opening opening = Opening::kAtOnce;
  std::vector<std::filesystem::path> attachments{};
  std::filesystem::path checkpoint_dir{};  // empty: none
  mcap::Pairs metadata{};                  // "recording": what is known before
};

// One thread. Every file holds, in this order: the IDL, the attachments, the newest checkpoint of
// each gyro ("checkpoint/begin/..."), messages, checkpoints that are newer by then
// ("checkpoint/end/..."), metadata "recording".
class RecordFile {
 public:
  // Reads the attachments. Throws McapError or std::invalid_argument with one line.
  explicit RecordFile(RecordFileOptions options);

  // Opens a file where none is open. Throws McapError where the disk refuses.
  void write(const QueuedMessage& message);
  // Hands the open chunk to the operating system; with `kToMedium`, that to the disk.
  enum class Durability : std::uint8_t { kProcess, kMedium };
  void flush(Durability durability);
  // Ends the open file, if there is one. `more`: metadata that is known only now. Where the disk
  // refuses, the file is left as .active, readable as far as it goes, what it still waited for is
  // lost, and the next message begins another.
  void finish(const mcap::Pairs& more);

  [[nodiscard]] bool is_open() const noexcept { return writer_ != nullptr; }
  // `arrival_ns`: of the newest message.
  [[nodiscard]] bool is_due_to_split(std::int64_t arrival_ns) const noexcept;
  // Of all files: those that the operating system has, and those in the open chunk. Of what
  // write() was given, the rest is lost.
  [[nodiscard]] std::uint64_t messages() const noexcept;
  [[nodiscard]] std::uint64_t waiting() const noexcept;
  // Of all files.
  [[nodiscard]] std::uint64_t bytes() const noexcept;
  // Nothing is open, and the newest file could not be finished.
  [[nodiscard]] bool was_cut() const noexcept { return was_cut_; }
  // By the names they have now: .active those that are open or could not be finished.
  [[nodiscard]] const std::vector<std::filesystem::path>& files() const noexcept { return files_; }
  // What an earlier recording left was moved to; empty: nothing was.
  [[nodiscard]] const std::filesystem::path& moved_aside() const noexcept { return moved_aside_; }

 private:
  struct Attached {
    std::string name{};
    std::string data{};
    std::int64_t created_ns = 0;
  };
  using Key = std::tuple<std::uint32_t, std::uint32_t, std::string>;  // topic, gyro, part

  void open(std::int64_t now_ns);
  void finish_open(const mcap::Pairs& more);
  void close() noexcept;
  [[nodiscard]] std::filesystem::path next_path();
  [[nodiscard]] std::unique_ptr<mcap::LogFile> next_file();
  // Channels are of a topic, gyro and probe. Of more than kMostChannels those that come later share
  // one of their topic, whose metadata names neither, as in files of others.
  static constexpr std::size_t kMostChannels = 4096;
  std::uint16_t channel_of(const QueuedMessage& message);
  void attach(const Attached& attached, const char* media_type, std::int64_t now_ns);
  void attach_checkpoints(const char* when, std::int64_t now_ns);
  static Attached read(const std::filesystem::path& file, const std::string& name);

  RecordFileOptions options_;
  std::vector<Attached> attachments_;
  std::unique_ptr<mcap::LogFile> file_;
  std::unique_ptr<mcap::Writer> writer_;
  std::map<Key, std::uint16_t> channels_;
  std::map<std::uint32_t, std::uint16_t> schemas_;  // by topic
  std::map<std::filesystem::path, std::filesystem::file_time_type> checkpoints_reported_;
  std::optional<std::int64_t> first_arrival_ns_;  // in the open file
  std::int64_t newest_ns_ = 0;                    // Unix time
  std::uint64_t messages_before_ = 0;             // in files that are over
  std::uint64_t bytes_before_ = 0;
  bool was_cut_ = false;
  std::uint32_t number_ = 1;  // of the next file, where nothing has its name
  std::vector<std::filesystem::path> files_;
  std::filesystem::path moved_aside_;
};

}  // namespace zerodrift::recording
