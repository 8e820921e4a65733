// SPDX-License-Identifier: Apache-2.0
// A Protobuf message as a schema of the Foxglove protocol.
#pragma once

#include <string>
#include <string_view>

#include "common/foxglove/protocol.h"

namespace google::protobuf {
class Descriptor;
}

namespace zerodrift::foxglove {

// The binary FileDescriptorSet of the message's file and all that it imports, imports first, in
// base64.
Schema schema_of(const google::protobuf::Descriptor& message);

// RFC 4648, section 4.
std::string base64(std::string_view bytes);

}  // namespace zerodrift::foxglove
