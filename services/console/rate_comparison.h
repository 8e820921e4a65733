// SPDX-License-Identifier: Apache-2.0
// Raw against compensated rate of an axis: the spread of means over blocks of a minute, which is
// that of the drift, since the white noise is averaged out. Seconds whose true rate is known, which
// is taken off both, and seconds at rest, in which the Earth's rate stays, make blocks of their
// own; the comparison is over the kind of which there are more. Blocks of motion are left out, and
// so are those that are not filled to four fifths. Sensor time alone drives it. Bounded by what is
// kept of the history.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "common/core/mode.h"
#include "idl/proto/telemetry.pb.h"

namespace zerodrift::services {

// Means over one second, deg/h; NaN where there was nothing.
struct RateSecond {
  std::int64_t second = 0;
  double raw_deg_h = 0.0;
  double compensated_deg_h = 0.0;
  double reference_deg_h = 0.0;  // NaN: the true rate is not known
  std::uint8_t mode = 0;         // core::Mode
  bool moves = false;            // says_motion() of a sample in it
  bool rests = false;            // says_rest() of one
};

// True where the gyro is not known to be at rest, so that its rate is not known to be drift: also
// where it may settle yet, or turns so steadily that only its level tells it.
bool says_motion(core::Reason reason);
// True where it is known to be at rest. Most reasons say neither.
bool says_rest(core::Mode mode, core::Reason reason);

class RateComparison {
 public:
  static constexpr std::int64_t kBlockS = 60;

  // Seconds in order. What came before the last step that is no drift, from passthrough or from a
  // mean held until the first model, is forgotten. O(1).
  void add(const RateSecond& row);
  void forget_before(std::int64_t second);

  // `moves`: it is in motion now, and unless some block is known to be at rest, all of them may be.
  // O(blocks).
  [[nodiscard]] telemetry::RateComparison result(bool moves) const;

 private:
  enum class Stage : std::uint8_t { kComparable, kPassthrough, kHeld };
  struct Block {
    std::int64_t index = 0;
    std::uint32_t rows = 0;
    double raw_mean = 0.0;
    double raw_squares = 0.0;  // sum of squares about the mean
    double compensated_mean = 0.0;
    bool certain = false;  // known to be at rest in there, or the true rate is known
    bool moves = false;    // and the true rate isn't known
    [[nodiscard]] bool is_filled() const;
    [[nodiscard]] double within() const;  // standard deviation of the raw rows in it
  };
  using Blocks = std::deque<Block>;
  // Means of those blocks of a kind that count.
  struct Counted {
    std::vector<double> raw{};
    std::vector<double> compensated{};
    bool is_certain = false;  // one of them
    bool has_motion = false;  // a block was left out for it
  };
  // True where the row is to be compared.
  bool take_step(std::uint8_t mode);
  static Counted counted(const Blocks& blocks);

  Stage stage_ = Stage::kComparable;
  Blocks at_rest_;
  Blocks against_reference_;
};

}  // namespace zerodrift::services
