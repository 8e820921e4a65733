// SPDX-License-Identifier: Apache-2.0
#include "tests/architecture/dependency_log.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace zerodrift::architecture {
namespace {

constexpr std::string_view kIndent = "    ";

std::string absolute(const std::string& path, const std::filesystem::path& build_dir) {
  return (build_dir / path).lexically_normal().string();
}

std::string output_of(const std::string& command) {
  FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot run: " + command);
  std::string output;
  std::array<char, 65536> buffer{};
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
    output.append(buffer.data(), n);
  }
  if (::pclose(pipe) != 0) throw std::runtime_error("failed: " + command);
  return output;
}

bool is_source(const std::string& path) {
  return path.ends_with(".cpp") || path.ends_with(".cxx") || path.ends_with(".cc");
}

// Sources that went through one compiler run (cmake/Unity.cmake): each counts with all that was
// opened for any of them.
void split_united(std::vector<Compilation>& compilations) {
  std::vector<Compilation> split;
  for (Compilation& compilation : compilations) {
    if (compilation.source.find("/Unity/unity_") == std::string::npos) {
      split.push_back(std::move(compilation));
      continue;
    }
    const auto& opened = compilation.opened;
    std::vector<std::string> headers;
    std::remove_copy_if(opened.begin(), opened.end(), std::back_inserter(headers), is_source);
    for (const std::string& path : opened) {
      if (is_source(path)) split.push_back({.source = path, .opened = headers});
    }
  }
  compilations = std::move(split);
}

}  // namespace

std::vector<Compilation> parse_dependencies(std::istream& log,
                                            const std::filesystem::path& build_dir) {
  std::vector<Compilation> compilations;
  bool valid = false;
  bool first = false;
  for (std::string line; std::getline(log, line);) {
    if (line.empty()) continue;
    if (!line.starts_with(kIndent)) {
      valid = line.ends_with("(VALID)");
      first = true;
      continue;
    }
    if (!valid) continue;
    std::string path = absolute(line.substr(kIndent.size()), build_dir);
    if (first) {
      compilations.push_back({.source = std::move(path), .opened = {}});
      first = false;
    } else {
      compilations.back().opened.push_back(std::move(path));
    }
  }
  split_united(compilations);
  return compilations;
}

std::vector<Compilation> read_dependencies(const std::string& ninja,
                                           const std::filesystem::path& build_dir) {
  std::istringstream log(output_of("'" + ninja + "' -C '" + build_dir.string() + "' -t deps"));
  return parse_dependencies(log, build_dir);
}

}  // namespace zerodrift::architecture
