// SPDX-License-Identifier: Apache-2.0
#include "tests/system/files.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace zerodrift::system_test {
namespace {

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> result(1);
  for (const char c : line) {
    if (c == ',') {
      result.emplace_back();
    } else {
      result.back() += c;
    }
  }
  return result;
}

}  // namespace

std::string content(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void write(const std::filesystem::path& file, std::string_view text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

std::string first_difference(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::ifstream stream_a(a, std::ios::binary);
  std::ifstream stream_b(b, std::ios::binary);
  std::string line_a;
  std::string line_b;
  for (std::size_t line = 1;; ++line) {
    const bool more_a = static_cast<bool>(std::getline(stream_a, line_a));
    const bool more_b = static_cast<bool>(std::getline(stream_b, line_b));
    if (!more_a && !more_b) return line > 1 ? "" : "both files are empty or missing";
    if (!more_a) line_a = "(end of file)";
    if (!more_b) line_b = "(end of file)";
    if (more_a != more_b || line_a != line_b) {
      return "line " + std::to_string(line) + ":\n  " + line_a + "\n  " + line_b;
    }
  }
}

std::size_t Table::column(std::string_view name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found == columns.end()) throw std::out_of_range("no column " + std::string(name));
  return static_cast<std::size_t>(found - columns.begin());
}

Table read_table(const std::filesystem::path& file) {
  std::ifstream stream(file);
  Table table;
  std::string line;
  while (std::getline(stream, line)) {
    if (line.starts_with('#')) continue;
    if (table.columns.empty()) {
      table.columns = cells(line);
    } else {
      table.rows.push_back(cells(line));
    }
  }
  return table;
}

std::set<std::string> shared_memory_segments() {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/shm")) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("fastrtps") || name.starts_with("fast_datasharing")) names.insert(name);
  }
  return names;
}

}  // namespace zerodrift::system_test
