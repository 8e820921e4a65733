// SPDX-License-Identifier: Apache-2.0
// What a diagnosis says: its vocabulary, without how it is found.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/not_known.h"

namespace zerodrift::diagnosis {

enum class Verdict {
  kConsistent,     // nothing is missing that this record could have shown
  kUndecidable,    // the record can't tell, or can't prove what it suggests; another one could
  kRecalibrated,   // the model's effects are the right ones, their parameters were not
  kEffectNamed,    // one or more effects are missing, and these are their names
  kAmbiguous,      // something is missing; several names explain it about equally well
  kUnknownEffect,  // something is missing that the catalogue doesn't know
};

[[nodiscard]] std::string_view name(Verdict verdict);

// A range of one quantity in which measurement and twin disagree more than noise allows.
struct Disagreement {
  // time, temperature, temperature_rate, rate, frequency, allan_tau or the name of a channel
  std::string kind;
  double from = 0.0;  // s, °C, °C/min, deg/h, Hz, s, or the channel's own unit
  double to = 0.0;
  double excess = 1.0;   // measured over expected mean square
  double p_value = 1.0;  // corrected for the number of ranges looked at
};

struct Alternative {
  std::string name;
  double probability = 0.0;
  // Fitted in place of the effect beside which it stands, as there. Empty of what is no waveform.
  std::vector<std::string> inputs{};
  std::map<std::string, double> parameters{};
};

struct NamedEffect {
  std::string name;                         // of the catalogue, or "formula"
  double probability = 0.0;                 // that it is this one, given that something is there
  std::vector<Alternative> alternatives{};  // the rest of the 95 % set, most probable first
  std::vector<std::string> inputs{};        // the temperatures it reads
  std::map<std::string, double> parameters{};
  std::map<std::string, double> standard_errors{};
  double log_evidence = 0.0;  // natural logarithm of its Bayes factor against the model without it
  double share_of_gap = 0.0;  // of the explained mean square, 0 to 1
  std::string formula{};      // of one that the model lists
};

struct Recalibration {
  std::string name;
  std::string parameter{};
  double from = 0.0;
  double to = 0.0;
  double standard_error = core::kNaN;  // NaN: not known
};

struct UnknownEffect {
  std::string description;  // "bump at 24 °C in temperature_coil"; its formulas where it has any
  std::vector<std::string> depends_on{};  // empty of what looks like effects that were refuted
  double rms_radps = 0.0;                 // NaN of what looks like noise
  // Its shape: the unexplained rate as a function of the first input. Empty where it has none.
  std::vector<double> input{};
  std::vector<double> rate_radps{};
  // The summands that stand for it in the repaired model, each proved: effects of kind "formula".
  std::vector<NamedEffect> formulas{};
  // Kinds of noise, what happened once, and what may be one effect or another, that what it leaves
  // looks like. The repaired model has all but what happened once, and they are not named: the rest
  // of a form that nobody knows looks the same.
  std::vector<NamedEffect> noise{};
};

struct NotTestable {
  std::string name;
  std::string why;
};

struct SmallestVisible {
  std::string name;
  double rms_radps = 0.0;  // of its waveform over this record, at d = 8
};

// RMS of the 60 s means of measurement minus twin, an offset included.
struct Gap {
  double before_rms_radps = 0.0;
  double after_rms_radps = 0.0;
  double noise_floor_rms_radps = 0.0;  // expected of the fitted noise alone
};

// Mean over tau of |ln(measured / twin)|, Allan deviations. NaN of a twin that has none, as one
// whose noise has no coefficients yet: it is as far as can be, not at distance 0.
struct AllanDistance {
  double before = 0.0;
  double after = 0.0;
};

enum class HeldOut {
  kNothing,  // the record is too short to keep anything back
  kRecords,  // the records given for validation
  kBlocks,   // blocks of the record itself, with guards between
};

enum class Acceptance {
  kNothingToProve,
  kAccepted,
  kReverted,  // held-out data did not agree: the model is left as it was
  kUnproven,  // nothing could be kept back to prove it on: the model is left as it was
};

// One candidate, whether it was named or not.
struct Evidence {
  std::string name;
  double log_evidence = 0.0;  // against the model as given, noise refitted under both
  double separation = 0.0;    // d: norm of the whitened, projected waveform at the best fit
  double rms_radps = 0.0;     // of that waveform
};

// Curves for pictures, all on one grid of times.
struct Waveforms {
  std::vector<double> time_s{};
  std::vector<double> measured_radps{};  // 60 s means, true rate taken off
  std::vector<double> before_radps{};    // the twin as given
  std::vector<double> after_radps{};     // the twin as repaired
};

struct AllanCurves {
  std::vector<double> tau_s{};
  std::vector<double> measured_radps{};
  std::vector<double> before_radps{};
  std::vector<double> after_radps{};
};

// Residual against the input that the named (or unknown) effect follows.
struct ResidualAgainstInput {
  std::string input;  // with its unit
  std::vector<double> value{};
  std::vector<double> residual_radps{};
  std::vector<double> explained_radps{};
};

struct AxisDiagnosis {
  Verdict verdict = Verdict::kConsistent;
  std::string sentence;              // the verdict for people
  bool examined = true;              // false: the record says nothing, and there are no figures
  std::size_t samples_left_out = 0;  // wild ones that stand alone, too few to be called spikes
  std::vector<Disagreement> where{};
  std::vector<NamedEffect> effects{};
  std::vector<Recalibration> recalibrated{};
  std::optional<UnknownEffect> unknown{};
  Gap fit{};
  HeldOut held_out_kind = HeldOut::kNothing;
  Gap held_out{};
  AllanDistance allan_log_distance{};
  Acceptance acceptance = Acceptance::kNothingToProve;
  // What was found and could not be proved, so that the model was left without it.
  std::vector<NamedEffect> taken_back{};
  std::vector<NotTestable> not_testable{};
  std::vector<SmallestVisible> could_have_seen{};
  std::string next_experiment;
  std::vector<Evidence> evidence{};  // strongest first
  Waveforms waveforms{};
  AllanCurves allan{};
  std::optional<ResidualAgainstInput> residual{};
};

}  // namespace zerodrift::diagnosis
