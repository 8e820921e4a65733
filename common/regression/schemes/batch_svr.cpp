// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/batch_svr.h"

#include <libsvm/svm.h>

#include <array>
#include <cassert>
#include <cmath>
#include <vector>

#include "common/core/require.h"
#include "common/regression/schemes/option_error.h"

namespace zerodrift::regression {
namespace {

constexpr int kEndOfNodes = -1;

void print_nothing(const char* /*text*/) {}

struct FreeModel {
  void operator()(svm_model* model) const noexcept { svm_free_and_destroy_model(&model); }
};

// Writes features.size() + 1 nodes.
void write_nodes(std::span<const double> features, svm_node* nodes) noexcept {
  for (std::size_t d = 0; d < features.size(); ++d) {
    nodes[d] = {.index = static_cast<int>(d) + 1, .value = features[d]};
  }
  nodes[features.size()] = {.index = kEndOfNodes, .value = 0.0};
}

svm_parameter parameter_of(const BatchSvrOptions& options) {
  svm_parameter parameter{};
  parameter.svm_type = EPSILON_SVR;
  parameter.kernel_type = RBF;
  parameter.gamma = options.gamma;
  parameter.cache_size = 100.0;  // MB
  parameter.eps = 1e-3;          // LIBSVM's own default for the stopping tolerance
  parameter.C = options.box_constraint;
  parameter.p = options.epsilon;
  parameter.shrinking = 1;
  parameter.probability = 0;  // the only part of LIBSVM's regression that would draw random numbers
  return parameter;
}

}  // namespace

// LIBSVM's model points into the nodes that it was trained on, so they live and die together: the
// model is declared last and goes first.
struct BatchSvr::Model {
  std::vector<svm_node> nodes;
  std::unique_ptr<svm_model, FreeModel> svm;
};

std::optional<std::string> BatchSvrOptions::validate() const {
  if (auto error = initial.validate()) return error;
  if (!is_positive(box_constraint)) {
    return wrong_option("box_constraint", std::to_string(box_constraint), "a number above 0");
  }
  if (!is_positive(gamma)) return wrong_option("gamma", std::to_string(gamma), "a number above 0");
  if (!(std::isfinite(epsilon) && epsilon >= 0.0)) {
    return wrong_option("epsilon", std::to_string(epsilon), "a number of at least 0");
  }
  return std::nullopt;
}

BatchSvr::BatchSvr(const BatchSvrOptions& options)
    : options_(checked_options("batch SVR", options)), initial_(options.initial) {
  svm_set_print_string_function(&print_nothing);
}

BatchSvr::~BatchSvr() = default;

void BatchSvr::learn(const DriftLabel& label) {
  assert(is_learnable(label) && "a label must be finite, with positive duration and variance");
  if (is_trained()) return;
  const bool is_complete = initial_.add(label);
  offset_ = initial_.mean();
  if (!is_complete) return;
  scale_ = initial_.scale();

  const std::size_t nodes_per_label = initial_.dimension() + 1;
  auto model = std::make_unique<Model>();
  model->nodes.resize(initial_.size() * nodes_per_label);
  std::vector<svm_node*> rows(initial_.size());
  std::vector<double> targets(initial_.size());
  for (std::size_t i = 0; i < initial_.size(); ++i) {
    rows[i] = model->nodes.data() + i * nodes_per_label;
    write_nodes(initial_.features(i), rows[i]);
    targets[i] = (initial_.drifts()[i] - offset_) / scale_;
  }
  const svm_problem problem{
      .l = static_cast<int>(initial_.size()), .y = targets.data(), .x = rows.data()};
  const svm_parameter parameter = parameter_of(options_);
  core::require(svm_check_parameter(&problem, &parameter) == nullptr,
                "options that LIBSVM refuses do not pass validate()");
  model->svm.reset(svm_train(&problem, &parameter));
  model_ = std::move(model);
  initial_.release();
}

DriftPrediction BatchSvr::predict(double /*time_s*/, std::span<const double> features) const {
  if (!is_trained()) return {.drift = offset_, .variance = -1.0};
  core::require(features.size() == initial_.dimension(), "features are as many as the labels had");
  std::array<svm_node, kMaxDimension + 1> nodes;
  write_nodes(features, nodes.data());
  return {.drift = offset_ + scale_ * svm_predict(model_->svm.get(), nodes.data()),
          .variance = -1.0};
}

std::size_t BatchSvr::support_size() const noexcept {
  return is_trained() ? static_cast<std::size_t>(svm_get_nr_sv(model_->svm.get())) : 0;
}

}  // namespace zerodrift::regression
