// SPDX-License-Identifier: Apache-2.0
#include "common/recording/record_file.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "common/dds/idl_text.h"
#include "common/files/input_file.h"
#include "common/files/unfinished_file.h"

namespace zerodrift::recording {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestAttachment = std::size_t{1} << 30U;  // it is held in memory

std::int64_t unix_ns_of(fs::file_time_type time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::file_clock::to_sys(time).time_since_epoch())
      .count();
}

std::uint64_t stamp(std::int64_t time_ns) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, time_ns));
}

// The newest checkpoint of each gyro: "<gyro>-<name>.ckpt".
std::vector<fs::path> newest_checkpoints(const fs::path& folder) {
  std::map<std::string, std::pair<fs::file_time_type, fs::path>> newest;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    const auto dash = name.find('-');
    if (entry.path().extension() != ".ckpt" || name.starts_with('.') || dash == std::string::npos)
      continue;
    const auto time = entry.last_write_time(error);
    if (error) continue;
    auto& known = newest[name.substr(0, dash)];
    if (known.second.empty() || time > known.first) known = {time, entry.path()};
  }
  std::vector<fs::path> files;
  for (const auto& [gyro, file] : newest) files.push_back(file.second);
  return files;
}

}  // namespace

RecordFile::RecordFile(RecordFileOptions options) : options_(std::move(options)) {
  for (const auto& file : options_.attachments)
    attachments_.push_back(read(file, file.filename().string()));
  if (!options_.checkpoint_dir.empty() && !fs::is_directory(options_.checkpoint_dir)) {
    throw std::invalid_argument("--attach-checkpoint: " + options_.checkpoint_dir.string() +
                                " is no folder");
  }
  // A disk that refuses is better known now than when the first message comes.
  if (options_.opening == Opening::kAtOnce) open(0);
}

RecordFile::Attached RecordFile::read(const fs::path& file, const std::string& name) {
  std::string data = files::read_whole_file(file, kLargestAttachment);
  return {name, std::move(data), unix_ns_of(fs::last_write_time(file))};
}

fs::path RecordFile::next_path() {
  if (!options_.is_numbered) return options_.out;
  for (;; ++number_) {
    char number[16];
    std::snprintf(number, sizeof number, "_%04u", number_);
    fs::path path = files::beside(
        options_.out, options_.out.stem().string() + number + options_.out.extension().string());
    if (!fs::exists(path)) return path;
  }
}

// A name that another recording took meanwhile is passed over, but not by the first file of one
// that begins at once: that is better refused.
std::unique_ptr<mcap::LogFile> RecordFile::next_file() {
  const bool may_pass = options_.is_numbered &&
                        (options_.opening == Opening::kWithTheFirstMessage || !files_.empty());
  for (;;) {
    try {
      return std::make_unique<mcap::LogFile>(next_path());
    } catch (const mcap::FileInUse&) {
      if (!may_pass) throw;
      ++number_;
    }
  }
}

void RecordFile::open(std::int64_t now_ns) {
  auto file = next_file();
  if (moved_aside_.empty()) moved_aside_ = file->moved_aside();
  auto* sink = file.get();
  auto writer = std::make_unique<mcap::Writer>(
      [sink](std::string_view bytes) { sink->append(bytes); }, options_.writer);
  files_.push_back(file->target());
  files_.back() += ".active";
  file_ = std::move(file);
  writer_ = std::move(writer);
  was_cut_ = false;
  ++number_;
  channels_.clear();
  schemas_.clear();
  first_arrival_ns_.reset();
  newest_ns_ = now_ns;
  for (const auto& idl : dds::idl_texts())
    attach({"idl/" + std::string(idl.file), std::string(idl.text), 0}, "text/plain", now_ns);
  for (const auto& attached : attachments_) attach(attached, "application/octet-stream", now_ns);
  checkpoints_reported_.clear();
  attach_checkpoints("checkpoint/begin/", now_ns);
}

void RecordFile::attach(const Attached& attached, const char* media_type, std::int64_t now_ns) {
  writer_->attach({.log_time_ns = stamp(now_ns),
                   .create_time_ns = stamp(attached.created_ns),
                   .name = attached.name,
                   .media_type = media_type},
                  attached.data);
}

// Checkpoints appear whole and are never changed, so they may be read at any time.
void RecordFile::attach_checkpoints(const char* when, std::int64_t now_ns) {
  if (options_.checkpoint_dir.empty()) return;
  for (const auto& file : newest_checkpoints(options_.checkpoint_dir)) {
    std::error_code error;
    const auto time = fs::last_write_time(file, error);
    auto& reported = checkpoints_reported_[file];
    if (error || reported == time) continue;
    reported = time;
    attach(read(file, when + file.filename().string()), "application/octet-stream", now_ns);
  }
}

std::uint16_t RecordFile::channel_of(const QueuedMessage& message) {
  Key key{message.topic, message.gyro_id, std::string(message.part)};
  if (const auto known = channels_.find(key); known != channels_.end()) return known->second;
  const bool is_named = channels_.size() < kMostChannels;
  if (!is_named) {
    key = {message.topic, 0, ""};
    if (const auto known = channels_.find(key); known != channels_.end()) return known->second;
  }
  const dds::TopicSpec& spec = dds::kAllTopics[message.topic];
  auto schema = schemas_.find(message.topic);
  if (schema == schemas_.end()) {
    schema = schemas_
                 .emplace(message.topic,
                          writer_->add_schema(spec.type, "omgidl", dds::idl_of(spec).text))
                 .first;
  }
  mcap::Pairs metadata;
  if (is_named && message.gyro_id != 0)
    metadata.emplace_back("gyro_id", std::to_string(message.gyro_id));
  if (is_named && !message.part.empty()) metadata.emplace_back("probe", std::string(message.part));
  const auto id = writer_->add_channel(schema->second, spec.name, "cdr", metadata);
  channels_.emplace(key, id);
  return id;
}

void RecordFile::write(const QueuedMessage& message) {
  if (!is_open()) open(message.log_ns);
  if (!first_arrival_ns_) first_arrival_ns_ = message.arrival_ns;
  newest_ns_ = message.log_ns;
  const std::uint16_t channel = channel_of(message);
  writer_->write({.channel_id = channel,
                  .sequence = static_cast<std::uint32_t>(message.sequence),
                  .log_time_ns = stamp(message.log_ns),
                  .publish_time_ns = stamp(message.publish_ns),
                  .data = message.payload});
}

void RecordFile::flush(Durability durability) {
  if (!is_open()) return;
  writer_->flush();
  if (durability == Durability::kMedium) file_->sync();
}

bool RecordFile::is_due_to_split(std::int64_t arrival_ns) const noexcept {
  if (!is_open() || writer_->statistics().messages == 0) return false;
  const bool is_long = options_.split_ns > 0 && first_arrival_ns_ &&
                       arrival_ns - *first_arrival_ns_ >= options_.split_ns;
  // The open chunk counts as if it were not compressed: a file is rather shorter than asked for.
  const bool is_large = options_.split_bytes > 0 &&
                        writer_->bytes() + writer_->open_chunk_bytes() >= options_.split_bytes;
  return is_long || is_large;
}

std::uint64_t RecordFile::bytes() const noexcept {
  return bytes_before_ + (is_open() ? writer_->bytes() : 0);
}

std::uint64_t RecordFile::messages() const noexcept {
  return messages_before_ + (is_open() ? writer_->statistics().messages - waiting() : 0);
}

std::uint64_t RecordFile::waiting() const noexcept {
  return is_open() ? writer_->open_chunk_messages() : 0;
}

void RecordFile::close() noexcept {
  bytes_before_ = bytes();
  messages_before_ = messages();
  writer_.reset();
  file_.reset();
}

void RecordFile::finish(const mcap::Pairs& more) {
  if (!is_open()) return;
  try {
    finish_open(more);
    files_.back() = file_->target();
  } catch (...) {
    close();  // nothing may follow half a summary
    was_cut_ = true;
    throw;
  }
  close();
}

void RecordFile::finish_open(const mcap::Pairs& more) {
  writer_->flush();
  attach_checkpoints("checkpoint/end/", newest_ns_);
  mcap::Metadata metadata{"recording", options_.metadata};
  metadata.values.insert(metadata.values.end(), more.begin(), more.end());
  writer_->add_metadata(metadata);
  writer_->finish();
  file_->commit();
}

}  // namespace zerodrift::recording
