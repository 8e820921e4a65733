// SPDX-License-Identifier: Apache-2.0
// Reads an MCAP file (https://mcap.dev/spec) that anybody may have written: by its summary, or,
// where that is missing or damaged, by a scan from the front that finds every whole chunk. What
// can't be read is left out and reported in one line each; lengths in the file never make it
// allocate more than the options allow.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/mcap/byte_source.h"
#include "common/mcap/format.h"
#include "common/mcap/parse.h"

namespace zerodrift::mcap {

struct ReaderOptions {
  std::uint64_t most_chunk_bytes = std::uint64_t{256} << 20U;  // compressed and not
  std::uint64_t most_attachment_bytes = std::uint64_t{1} << 30U;
  std::size_t chunks_kept = 8;  // uncompressed, for cursors that follow each other
};

// How the file ends.
enum class Ending : std::uint8_t {
  kWhole,
  kCut,      // no footer: cut, or still being written
  kDamaged,  // the summary can't be read; the file was scanned
};

// A stretch of the file that holds messages: a chunk, or messages outside of chunks.
enum class StretchKind : std::uint8_t { kChunk, kLoose };
struct Stretch {
  StretchKind kind = StretchKind::kChunk;
  Chunk chunk{};
};

struct Contents {
  std::string profile{};
  std::string library{};
  std::vector<Schema> schemas{};
  std::vector<Channel> channels{};
  std::vector<Stretch> stretches{};  // in the file's order
  std::vector<Attachment> attachments{};
  std::vector<Metadata> metadata{};
  Statistics statistics{};  // the file's own, or counted by the scan
  Ending ending = Ending::kWhole;

  [[nodiscard]] const Channel* channel(std::uint16_t id) const noexcept;
  [[nodiscard]] const Schema* schema(std::uint16_t id) const noexcept;
};

// True for a file that begins with MCAP's magic. False where it can't be opened.
[[nodiscard]] bool is_mcap(const std::filesystem::path& path);

class Reader {
 public:
  // `name` begins each line on what was found. Throws McapError where this is no MCAP file or the
  // medium fails; a damaged one is read as far as it goes. O(summary) or, by a scan, O(file).
  Reader(std::unique_ptr<const ByteSource> source, std::string name, ReaderOptions options = {});
  explicit Reader(const std::filesystem::path& path, ReaderOptions options = {});

  [[nodiscard]] const Contents& contents() const noexcept { return contents_; }
  // What was left out so far and why, one line each. Grows with reading.
  [[nodiscard]] const std::vector<std::string>& findings() const noexcept { return findings_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] std::uint64_t bytes() const { return source_->size(); }

  // The records of a stretch, checked and uncompressed; null where they can't be read, which
  // findings() reports once. Those used last are kept.
  [[nodiscard]] std::shared_ptr<const std::string> records(std::size_t stretch);

  // Those that are kept are kept no longer; they can be had again.
  void drop_records() noexcept { kept_.clear(); }

  // Throws McapError where it is cut, too long or its CRC is wrong.
  [[nodiscard]] std::string attachment(const Attachment& attachment) const;

  // Compares the whole data section with its CRC, which covers what no other CRC does, and reports
  // a difference in findings(). Nothing to compare in a file that was cut. O(file).
  void verify();

 private:
  enum class Found : std::uint8_t { kYes, kNo };
  struct ChunkBytes;

  void read_header();
  [[nodiscard]] Found read_summary();
  [[nodiscard]] Found take_summary(std::string_view records, std::uint64_t data_end);
  [[nodiscard]] Found read_metadata(const MetadataIndex& index);
  void scan();
  [[nodiscard]] std::optional<std::uint64_t> resume_after(std::uint64_t offset);
  // True if the record at `offset` was taken in; `next` is where the one behind it begins.
  enum class Step : std::uint8_t { kGoOn, kEnd, kLost };
  [[nodiscard]] Step scan_record(std::uint64_t offset, std::uint64_t& next);
  void scan_chunk(std::uint64_t offset, std::uint64_t content_bytes);
  void scan_attachment(std::uint64_t offset, std::uint64_t content_bytes);
  void scan_loose(std::uint64_t offset, std::uint64_t record_bytes, const Message& message);
  void take_definition(const Record& record);
  void count(const Message& message);
  [[nodiscard]] std::string load(const Stretch& stretch, std::string& records) const;
  void report(std::uint64_t offset, const std::string& what);

  std::unique_ptr<const ByteSource> source_;
  std::string name_;
  ReaderOptions options_;
  Contents contents_;
  std::uint64_t first_record_ = 0;  // behind the header
  std::uint64_t data_end_ = 0;      // the record; 0: not known
  std::vector<std::string> findings_;
  std::set<std::size_t> unreadable_;
  std::deque<std::pair<std::size_t, std::shared_ptr<const std::string>>> kept_;
};

// The messages of a file in its order, stretch after stretch.
class Cursor {
 public:
  explicit Cursor(Reader& reader) : reader_(&reader) {}

  // False at the end. `message.data` is valid until the next call.
  [[nodiscard]] bool next(Message& message);
  // Share of the file's stretches behind, 0 to 1.
  [[nodiscard]] double progress() const noexcept;

 private:
  Reader* reader_;
  std::size_t stretch_ = 0;
  std::shared_ptr<const std::string> records_;
  std::string_view rest_;
};

}  // namespace zerodrift::mcap
