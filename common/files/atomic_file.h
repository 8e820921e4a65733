// SPDX-License-Identifier: Apache-2.0
// A file that appears whole or not at all: written into a temporary file beside the target, then
// fsync and rename. What is there already and is no regular file (a pipe, /dev/null, a terminal) is
// written straight and never replaced.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/files/unfinished_file.h"

namespace zerodrift::files {

class AtomicFile {
 public:
  // A link is followed: what it points to is replaced, not the link. A pipe without a reader is
  // waited for. Where the target is standard output itself, what else is said there goes to
  // standard error from then on. Throws FileError where the target is a folder, a socket or a
  // disk, or where its folder can't be written.
  explicit AtomicFile(std::filesystem::path target);

  // Without commit() or keep() nothing is left behind.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  // Remembers the first failure and drops whatever comes after it; check() and commit() report it.
  void append(std::string_view bytes) noexcept;

  // Throws FileError where an append() has failed.
  void check() const;

  // Makes the file durable and gives it its name. Throws FileError. Nothing may be appended after
  // it.
  void commit();

  // After a failure: what was written so far stays as <stem>.cut<N><extension>, as that of a
  // recording that was cut. Gives the name; empty where nothing could be kept.
  std::filesystem::path keep();

 private:
  std::filesystem::path target_;           // as it was named
  std::optional<UnfinishedFile> partial_;  // none: written straight
  std::filesystem::path replaced_;         // by the partial file; links followed
  int fd_ = -1;
  int first_error_ = 0;  // errno of the first append() that failed
};

// What commit() could not do later is better known before minutes of computing than after. Throws
// FileError.
void require_writable(const std::filesystem::path& target);

// A file of a command, by its option: {"--record", "a.csv"}; an empty name doesn't count.
struct NamedFile {
  std::string option{};
  std::string file{};
};

// Throws FileError where an output is an input or another output, by whatever path or link, or
// can't be written. To be called before anything is read: outputs replace what is there.
void check_outputs(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs);

}  // namespace zerodrift::files
