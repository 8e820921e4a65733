// SPDX-License-Identifier: Apache-2.0
#include "common/foxglove/schema.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <cstdint>
#include <set>

namespace zerodrift::foxglove {
namespace {

void add_with_imports(const google::protobuf::FileDescriptor& file,
                      std::set<const google::protobuf::FileDescriptor*>& seen,
                      google::protobuf::FileDescriptorSet& files) {
  if (!seen.insert(&file).second) return;
  for (int i = 0; i < file.dependency_count(); ++i)
    add_with_imports(*file.dependency(i), seen, files);
  file.CopyTo(files.add_file());
}

}  // namespace

Schema schema_of(const google::protobuf::Descriptor& message) {
  google::protobuf::FileDescriptorSet files;
  std::set<const google::protobuf::FileDescriptor*> seen;
  add_with_imports(*message.file(), seen, files);
  return {message.full_name(), base64(files.SerializeAsString())};
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return i + k < bytes.size() ? std::uint32_t{static_cast<std::uint8_t>(bytes[i + k])} : 0U;
    };
    const std::uint32_t group = byte(0) << 16U | byte(1) << 8U | byte(2);
    for (unsigned k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? kDigits[group >> (18U - 6U * k) & 0x3FU] : '=';
  }
  return text;
}

}  // namespace zerodrift::foxglove
