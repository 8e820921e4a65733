// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <boost/iostreams/categories.hpp>
#include <boost/iostreams/filter/gzip.hpp>
#include <boost/iostreams/filter/lzma.hpp>
#include <boost/iostreams/filtering_streambuf.hpp>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <ios>
#include <stdexcept>

#include "common/record/csv_cells.h"
#include "common/record/decimal_time.h"
#include "common/record/record_error.h"

namespace zerodrift::record {
namespace {

namespace io = boost::iostreams;

constexpr std::size_t kFlushAt = std::size_t{256} * 1024;

// Measured on 600 000 rows of rates: level 6 makes 15 % smaller files in 19 times the time.
constexpr unsigned kXzLevel = 1;

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& what, int error) {
  throw RecordError(path.string() + ": " + what + ": " + std::strerror(error));
}

// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int get() const noexcept { return fd_; }

  // 0, or what went wrong: some file systems report a failed write only here.
  int close() noexcept {
    if (fd_ < 0) return 0;
    const int result = ::close(std::exchange(fd_, -1));
    return result == 0 ? 0 : errno;
  }

 private:
  int fd_;
};

// The end of the compression chain. boost::iostreams swallows exceptions where it closes a chain,
// so the first failure is remembered here and asked for afterwards.
struct FileSink {
  using char_type = char;
  using category = io::sink_tag;

  int fd;
  int* first_error;

  std::streamsize write(const char* data, std::streamsize size) const {
    std::streamsize written = 0;
    while (written < size && *first_error == 0) {
      const ssize_t count = ::write(fd, data + written, static_cast<std::size_t>(size - written));
      if (count >= 0) {
        written += count;
      } else if (errno != EINTR) {
        *first_error = errno;
      }
    }
    return size;
  }
};

// ".<name>.<pid>.<n>.partial" beside the target, so that the rename stays within one file system.
std::pair<std::filesystem::path, int> create_partial(const std::filesystem::path& target) {
  const std::string stem =
      std::string{"."} + target.filename().string() + '.' + std::to_string(::getpid());
  for (int attempt = 0;; ++attempt) {
    std::filesystem::path partial = target;
    partial.replace_filename(stem + '.' + std::to_string(attempt) + ".partial");
    const int fd = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0) return {partial, fd};
    if (errno != EEXIST) refuse(target, "cannot create a file in its folder", errno);
  }
}

// Makes the rename itself survive a power cut. A file system that can't do this for a folder
// doesn't need it.
void sync_folder_of(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const Descriptor fd{::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  if (fd.get() >= 0) ::fsync(fd.get());
}

}  // namespace

struct RecordWriter::State {
  State(const std::filesystem::path& target, std::pair<std::filesystem::path, int> created)
      : path(target), partial(std::move(created.first)), file(created.second) {
    if (path.extension() == ".gz") chain.push(io::gzip_compressor());
    if (path.extension() == ".xz") chain.push(io::lzma_compressor(io::lzma_params(kXzLevel)));
    chain.push(FileSink{file.get(), &write_error}, static_cast<std::streamsize>(kFlushAt));
    pending.reserve(kFlushAt + 4096);
  }

  ~State() {
    try {
      chain.reset();
    } catch (...) {  // what is dropped may fail to be written
    }
    if (!committed) ::unlink(partial.c_str());
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void separate() {
    if (cells_in_row++ > 0) pending += ',';
  }

  void flush() {
    chain.sputn(pending.data(), static_cast<std::streamsize>(pending.size()));
    pending.clear();
    if (write_error != 0) refuse(path, "writing fails", write_error);
  }

  std::filesystem::path path;
  std::filesystem::path partial;
  Descriptor file;
  int write_error = 0;
  io::filtering_streambuf<io::output> chain;
  std::string pending;
  std::size_t column_count = 0;
  std::size_t cells_in_row = 0;
  bool committed = false;
};

RecordWriter::RecordWriter(const std::filesystem::path& path, const RecordWriterOptions& options) {
  if (options.columns.empty())
    throw RecordError(path.string() + ": a record needs at least one column");
  state_ = std::make_unique<State>(path, create_partial(path));
  for (const auto& [key, value] : options.metadata) {
    if ((key + value).find_first_of("\r\n") != std::string::npos) {
      throw RecordError(path.string() + ": metadata '" + printable(key) +
                        "' holds a line end; it must be one line");
    }
    ((((state_->pending += "# ") += key) += ": ") += value) += '\n';
  }
  state_->column_count = options.columns.size();
  for (const std::string& column : options.columns) text(column);
  end_row();
}

RecordWriter::~RecordWriter() = default;
RecordWriter::RecordWriter(RecordWriter&&) noexcept = default;
RecordWriter& RecordWriter::operator=(RecordWriter&&) noexcept = default;

void RecordWriter::time(core::SensorTime time) {
  state_->separate();
  state_->pending += print_seconds(time);
}

void RecordWriter::number(double value) {
  state_->separate();
  if (std::isnan(value)) return;
  std::array<char, 32> digits{};  // the longest shortest form of a double has 24 characters
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  state_->pending.append(digits.data(), end);
}

void RecordWriter::text(std::string_view cell) {
  state_->separate();
  state_->pending += quoted_if_needed(cell);
}

void RecordWriter::blank() {
  state_->separate();
}

void RecordWriter::end_row() {
  if (state_->cells_in_row != state_->column_count) {
    throw std::logic_error("a row of " + std::to_string(state_->cells_in_row) +
                           " cells in a record of " + std::to_string(state_->column_count) +
                           " columns");
  }
  state_->cells_in_row = 0;
  state_->pending += '\n';
  if (state_->pending.size() >= kFlushAt) state_->flush();
}

void RecordWriter::commit() {
  State& s = *state_;
  if (s.cells_in_row != 0) throw std::logic_error("commit() within a row");
  s.flush();
  s.chain.reset();  // writes what the compressor still holds
  if (s.write_error != 0) refuse(s.path, "writing fails", s.write_error);
  if (::fsync(s.file.get()) != 0) refuse(s.path, "fsync fails", errno);
  if (const int error = s.file.close()) refuse(s.path, "closing fails", error);
  if (::rename(s.partial.c_str(), s.path.c_str()) != 0)
    refuse(s.path, "cannot take this name", errno);
  s.committed = true;
  sync_folder_of(s.path);
}

}  // namespace zerodrift::record
