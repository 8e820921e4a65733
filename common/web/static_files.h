// SPDX-License-Identifier: Apache-2.0
// The files of a page, read once: what is asked for later is looked up in memory, so that no
// request opens a file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/web/message.h"

namespace zerodrift::web {

class StaticFiles {
 public:
  StaticFiles() = default;
  // All regular files below the folder; links are left out. Throws WebError where it can't be read
  // or holds more than 4096 files or 64 MiB.
  explicit StaticFiles(const std::filesystem::path& folder);

  // Nothing: there is no such file. "/" is "/index.html", and "/docs" leads to "/docs/" where that
  // has one. With an ETag, and 304 where the asker
  // has it; the precompressed "<name>.gz" where it is there and taken; a year for a name with a
  // hash in it ("/assets/index-B1a2C3d4.js"), else asked for again each time.
  [[nodiscard]] std::optional<Response> respond(const Request& request) const;

  [[nodiscard]] bool empty() const { return files_.empty(); }

 private:
  struct File {
    Body content;
    std::string etag;
  };
  std::map<std::string, File> files_;  // by their path, "/index.html"
};

// By the name's end; "application/octet-stream" for an unknown one.
std::string_view content_type_of(std::string_view path);
// A name that a bundler made of its content: "<name>-<8 or more of A-Z a-z 0-9 _ ->.<end>", in a
// folder "assets".
bool has_hashed_name(std::string_view path);

}  // namespace zerodrift::web
