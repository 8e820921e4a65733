// SPDX-License-Identifier: Apache-2.0
// What a report was made by and from, at its end, so that it can be made again; and the one way of
// writing reports, so that each has it.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/report/html_document.h"

namespace zerodrift::services {

struct Invocation {
  std::string version;       // service::version_line()
  std::string command_line;  // as a shell would take it
};

struct HashedFile {
  std::string name;
  std::string sha256;  // 64 hexadecimal digits, of the bytes as they are on the disk
};

struct Provenance {
  Invocation made_by;
  std::string date;          // "2026-03-31", UTC
  HashedFile configuration;  // without a name: the defaults
  std::vector<HashedFile> inputs;
};

[[nodiscard]] Invocation invocation_of(const char* version, int argc, const char* const* argv);
// Of SOURCE_DATE_EPOCH where that is set, so that a report can be made again to the bit; else of
// today, UTC. Throws std::invalid_argument where it is no time.
[[nodiscard]] std::string today();
// Throws files::FileError.
[[nodiscard]] HashedFile hashed(const std::string& file);
// Reads every file; `configuration` may be empty. Throws files::FileError.
[[nodiscard]] Provenance provenance_of(const Invocation& made_by, const std::string& configuration,
                                       const std::vector<std::string>& inputs);

// A paragraph each.
[[nodiscard]] std::vector<std::string> provenance_sentences(const Provenance& provenance);

// Where a report goes; an empty name is a file that nobody asked for.
struct ReportFiles {
  std::string json;
  std::string html;
  [[nodiscard]] bool any() const { return !json.empty() || !html.empty(); }
};
// The page is made where one is wanted: its pictures take seconds. Throws files::FileError.
void write_report(const ReportFiles& files, nlohmann::ordered_json json,
                  const std::function<report::Document()>& page, const Provenance& provenance);

}  // namespace zerodrift::services
