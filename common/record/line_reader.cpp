// SPDX-License-Identifier: Apache-2.0
#include "common/record/line_reader.h"

#include <zstd.h>
#include <zstd_errors.h>

#include <algorithm>
#include <boost/iostreams/concepts.hpp>
#include <boost/iostreams/device/file_descriptor.hpp>
#include <boost/iostreams/filter/gzip.hpp>
#include <boost/iostreams/filter/lzma.hpp>
#include <boost/iostreams/filtering_streambuf.hpp>
#include <boost/iostreams/read.hpp>
#include <cstring>
#include <ios>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "common/files/file_error.h"
#include "common/files/input_file.h"

namespace zerodrift::record {
namespace {

namespace io = boost::iostreams;

constexpr std::size_t kChunk = std::size_t{256} * 1024;
constexpr std::size_t kLongestLine = std::size_t{1024} * 1024;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

// Boost's own takes a stream that ends within a frame for a whole one.
class ZstdDecompressor : public io::multichar_input_filter {
 public:
  template <typename Source>
  std::streamsize read(Source& source, char* target, std::streamsize size) {
    State& s = *state_;
    ZSTD_outBuffer out{target, static_cast<std::size_t>(size), 0};
    while (out.pos == 0 && out.size > 0) {
      if (s.in.pos == s.in.size && !s.holds_output && !s.refill(source)) break;
      s.within_frame = ZSTD_decompressStream(s.stream.get(), &out, &s.in);
      if (ZSTD_getErrorCode(s.within_frame) == ZSTD_error_memory_allocation) throw std::bad_alloc();
      if (ZSTD_isError(s.within_frame) != 0U)
        throw std::ios_base::failure(ZSTD_getErrorName(s.within_frame));
      s.holds_output = s.within_frame != 0 && out.pos == out.size;
    }
    return out.pos > 0 ? static_cast<std::streamsize>(out.pos) : -1;
  }

 private:
  struct State {
    State() {
      if (stream == nullptr) throw std::bad_alloc();
    }

    std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> stream{ZSTD_createDCtx(), ZSTD_freeDCtx};
    std::vector<char> compressed = std::vector<char>(ZSTD_DStreamInSize());
    ZSTD_inBuffer in{nullptr, 0, 0};
    bool holds_output = false;     // more than the reader asked for
    std::size_t within_frame = 1;  // 0 between two frames; an empty file has none

    // False at the end of the file. Throws std::ios_base::failure where a frame is open.
    template <typename Source>
    bool refill(Source& source) {
      const std::streamsize count =
          io::read(source, compressed.data(), static_cast<std::streamsize>(compressed.size()));
      if (count <= 0 && within_frame != 0) throw std::ios_base::failure("zstd frame is cut");
      in = {compressed.data(), static_cast<std::size_t>(std::max(count, std::streamsize{0})), 0};
      return count > 0;
    }
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();  // Boost copies filters
};

}  // namespace

struct LineReader::State {
  std::filesystem::path path;
  io::filtering_streambuf<io::input> chain;
  std::vector<char> buffer;
  std::size_t begin = 0;  // buffer[begin, end) is read but not yet given out
  std::size_t end = 0;
  std::size_t line_number = 0;
  bool at_end = false;
  bool line_was_ended = true;

  // Throws files::FileError where the first line is UTF-16, as spreadsheets save "Unicode text":
  // by its byte-order mark, or by the zeros that every second byte of such digits is.
  void refuse_wide_text(std::string_view first) const {
    const bool is_marked = first.starts_with("\xFF\xFE") || first.starts_with("\xFE\xFF");
    const bool has_zeros = first.size() > 1 && (first[0] == '\0') != (first[1] == '\0');
    if (is_marked || has_zeros) {
      throw files::FileError(path.string() + ": text in UTF-16; a record is UTF-8: 'iconv -f " +
                             "UTF-16 -t UTF-8' makes it that");
    }
  }

  // Moves what is left to the front and reads more behind it.
  void refill() {
    std::copy(buffer.begin() + static_cast<std::ptrdiff_t>(begin),
              buffer.begin() + static_cast<std::ptrdiff_t>(end), buffer.begin());
    end -= begin;
    begin = 0;
    if (end == buffer.size()) {
      if (buffer.size() >= kLongestLine) {
        throw files::FileError(
            path.string() + ":" + std::to_string(line_number + 1) +
            ": a line of more than 1 MiB; a record is lines of comma-separated cells");
      }
      buffer.resize(2 * buffer.size());
    }
    const std::size_t count = read(buffer.data() + end, buffer.size() - end);
    at_end = count == 0;
    end += count;
  }

  std::size_t read(char* target, std::size_t size) {
    try {
      return static_cast<std::size_t>(
          std::max(std::streamsize{0}, chain.sgetn(target, static_cast<std::streamsize>(size))));
    } catch (const std::ios_base::failure& failure) {
      const bool compressed = chain.size() > 1;
      throw files::FileError(
          path.string() + ": " +
          (compressed ? "the compressed data is corrupt or cut" : "reading fails") +
          " behind line " + std::to_string(line_number) + " (" + failure.what() + ")");
    }
  }
};

LineReader::LineReader(const std::filesystem::path& path) : state_(std::make_unique<State>()) {
  state_->path = path;
  state_->buffer.resize(kChunk);
  const io::file_descriptor_source file{files::open_regular_file(path).release(), io::close_handle};
  const std::filesystem::path suffix = path.extension();
  if (suffix == ".gz")
    state_->chain.push(io::gzip_decompressor(), static_cast<std::streamsize>(kChunk));
  if (suffix == ".xz")
    state_->chain.push(io::lzma_decompressor(), static_cast<std::streamsize>(kChunk));
  if (suffix == ".zst")
    state_->chain.push(ZstdDecompressor(), static_cast<std::streamsize>(kChunk));
  state_->chain.push(file, static_cast<std::streamsize>(kChunk));
}

LineReader::~LineReader() = default;
LineReader::LineReader(LineReader&&) noexcept = default;
LineReader& LineReader::operator=(LineReader&&) noexcept = default;

bool LineReader::next(std::string_view& line) {
  State& s = *state_;
  std::size_t searched = 0;
  const char* line_end = nullptr;
  while (true) {
    const char* from = s.buffer.data() + s.begin;
    const std::size_t available = s.end - s.begin;
    line_end = static_cast<const char*>(std::memchr(from + searched, '\n', available - searched));
    if (line_end != nullptr || s.at_end) break;
    searched = available;
    s.refill();
  }
  const char* from = s.buffer.data() + s.begin;
  s.line_was_ended = line_end != nullptr;
  if (!s.line_was_ended) {
    line_end = s.buffer.data() + s.end;
    if (line_end == from) return false;
  }
  line = {from, static_cast<std::size_t>(line_end - from)};
  s.begin += line.size() + (s.line_was_ended ? 1 : 0);
  if (line.ends_with('\r')) line.remove_suffix(1);
  if (++s.line_number == 1) {
    s.refuse_wide_text(line);
    if (line.starts_with(kByteOrderMark)) line.remove_prefix(kByteOrderMark.size());
  }
  return true;
}

std::size_t LineReader::line_number() const noexcept {
  return state_->line_number;
}
bool LineReader::line_was_ended() const noexcept {
  return state_->line_was_ended;
}

}  // namespace zerodrift::record
