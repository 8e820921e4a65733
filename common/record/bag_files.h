// SPDX-License-Identifier: Apache-2.0
// Where the bytes of a record are: one file, or the files of a rosbag2 folder as its metadata.yaml
// names them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace zerodrift::record {

// An MCAP file by its first bytes, or a rosbag2 folder by its being a folder: what was live once.
// False where it can't be opened.
[[nodiscard]] bool is_mcap_record(const std::filesystem::path& path);

// The MCAP files of a bag, in its order: the path itself where it is no folder. Throws
// files::FileError with the cure for a bag that was stored otherwise (SQLite, ROS 1, compressed as
// whole files or message by message), cut (no metadata.yaml) or names files outside its folder.
[[nodiscard]] std::vector<std::filesystem::path> mcap_files_of(const std::filesystem::path& path);

// Every file that a record is read from, metadata.yaml first where it has one: what a report names
// as its inputs. Throws as mcap_files_of().
[[nodiscard]] std::vector<std::string> input_files_of(const std::string& record);

// Throws files::FileError with the cure where the file begins as a bag that is no MCAP.
void refuse_other_bags(const std::filesystem::path& path);

// What metadata.yaml says; `name` begins each line of refusal. Throws files::FileError.
struct BagMetadata {
  std::vector<std::string> files{};  // relative to the folder, in order; none leaves it
};
[[nodiscard]] BagMetadata parse_bag_metadata(const std::string& text, const std::string& name);

}  // namespace zerodrift::record
