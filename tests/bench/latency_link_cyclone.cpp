// SPDX-License-Identifier: Apache-2.0
// One hop of Cyclone DDS: a module beside the program where the build has it, so that the program
// itself needs no other vendor's middleware.
#include <dlfcn.h>

#include <stdexcept>

#include "tests/bench/bench_process.h"
#include "tests/bench/cyclone_hop.h"
#include "tests/bench/latency_link.h"

namespace zerodrift::bench {
namespace {

struct CycloneModule {
  decltype(&cyclone_hop_open) open = nullptr;
  decltype(&cyclone_hop_close) close = nullptr;
  decltype(&cyclone_hop_connected) connected = nullptr;
  decltype(&cyclone_hop_send) send = nullptr;
};

std::filesystem::path cyclone_module() {
  return program_folder() / "libzerodrift_cyclone_hop.so";
}

// Loaded once, for the rest of the program's life.
const CycloneModule& cyclone() {
  static const CycloneModule module = [] {
    void* library = ::dlopen(cyclone_module().c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) throw std::runtime_error(std::string("bench: ") + ::dlerror());
    CycloneModule loaded;
    const auto find = [&](auto& function, const char* name) {
      function = reinterpret_cast<std::decay_t<decltype(function)>>(::dlsym(library, name));
      if (function == nullptr) throw std::runtime_error(std::string("bench: no ") + name);
    };
    find(loaded.open, "cyclone_hop_open");
    find(loaded.close, "cyclone_hop_close");
    find(loaded.connected, "cyclone_hop_connected");
    find(loaded.send, "cyclone_hop_send");
    return loaded;
  }();
  return module;
}

class CycloneLink final : public LatencyLink {
 public:
  CycloneLink(const LinkOptions& options, OnPing on_ping)
      : on_ping_(std::move(on_ping)),
        hop_(cyclone().open(
            options.network.domain, options.name.c_str(), options.end != LinkEnd::kFar,
            [](void* self, const cyclone_sample* sample) {
              static_cast<CycloneLink*>(self)->on_ping_(
                  {sample->sequence, sample->sent_ns, sample->interval_s});
            },
            this)) {
    if (hop_ == nullptr) throw std::runtime_error("bench: Cyclone DDS refuses a participant");
  }
  ~CycloneLink() override { cyclone().close(hop_); }
  bool connected() override { return cyclone().connected(hop_); }
  void send(const Ping& ping) override {
    const cyclone_sample sample{ping.sequence, ping.sent_ns, ping.interval_s};
    cyclone().send(hop_, &sample);
  }

 private:
  OnPing on_ping_;
  cyclone_hop* hop_;
};

}  // namespace

bool has_cyclone_link() {
  return std::filesystem::exists(cyclone_module());
}

std::unique_ptr<LatencyLink> open_cyclone_link(const LinkOptions& options,
                                               LatencyLink::OnPing on_ping) {
  return std::make_unique<CycloneLink>(options, std::move(on_ping));
}

}  // namespace zerodrift::bench
