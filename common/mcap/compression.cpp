// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/compression.h"

#include <lz4frame.h>
#include <zstd.h>
#include <zstd_errors.h>

#include <new>

#include "common/mcap/mcap_error.h"

namespace zerodrift::mcap {
namespace {

// The fastest of each: a recorder has to keep up, and doubles of a gyro are mostly noise.
constexpr int kZstdLevel = 1;

void compress_zstd(std::string_view bytes, std::string& to) {
  const std::size_t begin = to.size();
  to.resize(begin + ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress(to.data() + begin, to.size() - begin, bytes.data(), bytes.size(), kZstdLevel);
  if (ZSTD_isError(size) != 0) throw McapError(std::string("zstd: ") + ZSTD_getErrorName(size));
  to.resize(begin + size);
}

void compress_lz4(std::string_view bytes, std::string& to) {
  const std::size_t begin = to.size();
  LZ4F_preferences_t preferences = LZ4F_INIT_PREFERENCES;
  preferences.frameInfo.contentSize = bytes.size();
  to.resize(begin + LZ4F_compressFrameBound(bytes.size(), &preferences));
  const std::size_t size = LZ4F_compressFrame(to.data() + begin, to.size() - begin, bytes.data(),
                                              bytes.size(), &preferences);
  if (LZ4F_isError(size) != 0) throw McapError(std::string("lz4: ") + LZ4F_getErrorName(size));
  to.resize(begin + size);
}

bool decompress_zstd(std::string_view bytes, std::string& to) {
  const std::size_t size = ZSTD_decompress(to.data(), to.size(), bytes.data(), bytes.size());
  if (ZSTD_getErrorCode(size) == ZSTD_error_memory_allocation) throw std::bad_alloc();
  return size == to.size();
}

bool decompress_lz4(std::string_view bytes, std::string& to) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0)
    throw std::bad_alloc();
  std::size_t written = 0;
  std::size_t expected = 1;  // bytes that the frame still asks for; 0: it is over
  while (expected != 0 && !bytes.empty()) {
    std::size_t taken = bytes.size();
    std::size_t given = to.size() - written;
    expected = LZ4F_decompress(context, to.data() + written, &given, bytes.data(), &taken, nullptr);
    if (LZ4F_isError(expected) != 0 || (taken == 0 && given == 0)) break;
    bytes.remove_prefix(taken);
    written += given;
  }
  LZ4F_freeDecompressionContext(context);
  // Its error codes are of no stable interface, their names are.
  if (std::string_view(LZ4F_getErrorName(expected)) == "ERROR_allocation_failed")
    throw std::bad_alloc();
  return expected == 0 && bytes.empty() && written == to.size();
}

}  // namespace

std::string_view name(Compression compression) noexcept {
  switch (compression) {
    case Compression::kLz4: return "lz4";
    case Compression::kZstd: return "zstd";
    case Compression::kNone: break;
  }
  return "";
}

std::optional<Compression> compression_of(std::string_view name) noexcept {
  if (name.empty()) return Compression::kNone;
  if (name == "lz4") return Compression::kLz4;
  if (name == "zstd") return Compression::kZstd;
  return std::nullopt;
}

void compress(Compression compression, std::string_view bytes, std::string& to) {
  switch (compression) {
    case Compression::kNone: to.append(bytes); return;
    case Compression::kLz4: return compress_lz4(bytes, to);
    case Compression::kZstd: return compress_zstd(bytes, to);
  }
}

bool decompress(Compression compression, std::string_view bytes, std::size_t size,
                std::string& to) {
  if (compression == Compression::kNone) {
    to.assign(bytes);
    return bytes.size() == size;
  }
  to.resize(size);
  return compression == Compression::kZstd ? decompress_zstd(bytes, to) : decompress_lz4(bytes, to);
}

}  // namespace zerodrift::mcap
