// SPDX-License-Identifier: Apache-2.0
#include "common/record/bag_files.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "common/core/one_line.h"
#include "common/files/file_error.h"
#include "common/files/input_file.h"
#include "common/mcap/mcap_reader.h"

namespace zerodrift::record {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMetadata = "metadata.yaml";
constexpr std::size_t kMostMetadataBytes = std::size_t{4} << 20U;
constexpr std::size_t kMostShown = 60;  // of a foreign word, bytes
constexpr const char* kConvert =
    "convert it with `ros2 bag convert` to storage_id mcap, or a .db3 with `mcap convert BAG.db3 "
    "BAG.mcap`";

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

std::string quoted(const std::string& text) {
  return "'" + core::one_line(text, kMostShown) + "'";
}

YAML::Node child(const YAML::Node& map, const char* key) {
  const YAML::Node node = map.IsMap() ? map[key] : YAML::Node();
  return node.IsDefined() ? node : YAML::Node();
}

// Empty where there is no such word.
std::string word(const YAML::Node& map, const char* key) {
  const YAML::Node node = child(map, key);
  return node.IsScalar() ? node.Scalar() : "";
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool stays_inside(const fs::path& path) {
  return !path.empty() && path.is_relative() &&
         std::none_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
}

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw files::FileError(name + ": " + why);
}

void refuse_other_storage(const YAML::Node& bag, const std::string& name) {
  if (const std::string storage = word(bag, "storage_identifier"); storage != "mcap") {
    refuse(name, "storage_identifier: found " + quoted(storage) + ", expected 'mcap'; " + kConvert);
  }
  const std::string mode = lower(word(bag, "compression_mode"));
  if (mode.empty() || mode == "none") return;
  refuse(name, "compression_mode: found " + quoted(mode) +
                   ", expected none (an .mcap file compresses its own chunks); " + kConvert);
}

BagMetadata take(const YAML::Node& root, const std::string& name) {
  constexpr const char* kBag = "rosbag2_bagfile_information";
  const YAML::Node bag = child(root, kBag);
  if (!bag.IsMap()) refuse(name, std::string("found no ") + kBag + ", expected rosbag2's metadata");
  refuse_other_storage(bag, name);
  const YAML::Node paths = child(bag, "relative_file_paths");
  if (!paths.IsSequence() || paths.size() == 0)
    refuse(name, "relative_file_paths: found no list of files, expected those of the bag");
  BagMetadata metadata;
  for (const YAML::Node& path : paths) {
    const std::string file = path.IsScalar() ? path.Scalar() : "";
    if (!stays_inside(file)) {
      refuse(name, "relative_file_paths: found " + quoted(file) +
                       ", expected the name of a file in the bag's folder");
    }
    metadata.files.push_back(file);
  }
  return metadata;
}

}  // namespace

BagMetadata parse_bag_metadata(const std::string& text, const std::string& name) {
  try {
    return take(YAML::Load(text), name);
  } catch (const YAML::Exception& error) {
    throw files::FileError(name + ":" + std::to_string(error.mark.line + 1) +
                           ": not valid YAML: " + core::one_line(error.msg));
  }
}

bool is_mcap_record(const fs::path& path) {
  return is_folder(path) || mcap::is_mcap(path);
}

std::vector<fs::path> mcap_files_of(const fs::path& path) {
  if (!is_folder(path)) {
    refuse_other_bags(path);
    return {path};
  }
  const fs::path metadata = path / kMetadata;
  std::error_code error;
  if (!fs::exists(metadata, error)) {
    refuse(path.string(),
           "is a folder without metadata.yaml, expected a file, or the folder of a ROS 2 bag "
           "(`ros2 bag reindex` writes a lost metadata.yaml)");
  }
  std::vector<fs::path> found;
  const std::string text = files::read_whole_file(metadata, kMostMetadataBytes);
  for (const std::string& file : parse_bag_metadata(text, metadata.string()).files)
    found.push_back(path / file);
  return found;
}

std::vector<std::string> input_files_of(const std::string& record) {
  if (!is_folder(record)) return {record};
  std::vector<std::string> names{(fs::path(record) / kMetadata).string()};
  for (const fs::path& file : mcap_files_of(record)) names.push_back(file.string());
  return names;
}

void refuse_other_bags(const fs::path& path) {
  constexpr std::string_view kSqlite{"SQLite format 3\0", 16};
  constexpr std::string_view kRos1 = "#ROSBAG V";
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return;
  const std::string begin = files::beginning_of(path, kSqlite.size());
  const std::string name = path.string();
  if (begin == kSqlite || path.extension() == ".db3")
    refuse(name, std::string("is a bag of ROS 2 in SQLite, expected one in MCAP; ") + kConvert);
  if (begin.starts_with(kRos1))
    refuse(name,
           "is a bag of ROS 1, expected one of ROS 2 in MCAP; convert it with rosbags-convert");
  if (path.extension() == ".zstd")
    refuse(name, "is compressed as a whole, expected .mcap; unpack it with `zstd -d`");
}

}  // namespace zerodrift::record
