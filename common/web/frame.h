// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "common/web/message.h"

namespace zerodrift::web {

// One WebSocket message on its way to a client. The body is shared between clients; the head is
// this client's own.
struct Frame {
  enum class Kind : std::uint8_t { kText, kBinary };
  enum class Importance : std::uint8_t {
    kSample,  // lost whole where the client is too slow
    kState    // never lost
  };
  Kind kind = Kind::kBinary;
  Importance importance = Importance::kState;
  // Not 0: a frame of the same number that still waits says nothing any more, this one takes its
  // place.
  std::uint64_t replaces = 0;
  std::uint8_t head_size = 0;
  std::array<std::uint8_t, 16> head{};
  Body body;

  [[nodiscard]] std::size_t size() const { return head_size + (body ? body->size() : 0); }
};

}  // namespace zerodrift::web
