// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bench_svr_peers.h"

#include <libsvm/svm.h>

#include <array>
#include <stdexcept>
#include <vector>

#if ZERODRIFT_WITH_DLIB
// dlib's headers alone are used. Left out before they are read: the check that headers and the
// compiled library match (it needs the library), and the BLAS that Debian's configuration asks for
// (on a dictionary of 40 vectors dlib's own loops are the faster).
#define DLIB_TEST_FOR_ODR_VIOLATIONS_H_
#include <dlib/algs.h>  // reads the configuration
#undef DLIB_USE_BLAS
#undef DLIB_USE_LAPACK
#include <dlib/svm/kernel.h>
#include <dlib/svm/krls.h>
#endif

namespace zerodrift::bench {
namespace {

constexpr int kEndOfNodes = -1;
using Nodes = std::array<svm_node, kDriftFeatures + 1>;

void print_nothing(const char* /*text*/) {}

struct FreeModel {
  void operator()(svm_model* model) const noexcept { svm_free_and_destroy_model(&model); }
};

Nodes nodes_of(const DriftFeatures& x) {
  Nodes nodes{};
  for (std::size_t d = 0; d < kDriftFeatures; ++d) {
    nodes[d] = {.index = static_cast<int>(d) + 1, .value = x[d]};
  }
  nodes.back() = {.index = kEndOfNodes, .value = 0.0};
  return nodes;
}

svm_parameter parameter_of(double tolerance) {
  svm_parameter parameter{};
  parameter.svm_type = EPSILON_SVR;
  parameter.kernel_type = RBF;
  parameter.gamma = kRbfGamma;
  parameter.C = kBoxConstraint;
  parameter.p = kTubeHalfWidth;
  parameter.eps = tolerance;
  parameter.cache_size = 100.0;  // MB, LIBSVM's default: holds the whole matrix up to W = 5000
  parameter.shrinking = 1;       // LIBSVM's default
  return parameter;
}

}  // namespace

// The model points into the nodes that it was trained on: it is declared last and goes first.
struct LibsvmRegression::State {
  svm_parameter parameter;
  std::vector<Nodes> samples;
  std::vector<svm_node*> sample_pointers;
  std::vector<double> targets;
  std::unique_ptr<svm_model, FreeModel> model;
};

LibsvmRegression::LibsvmRegression(double tolerance) : state_(std::make_unique<State>()) {
  svm_set_print_string_function(&print_nothing);
  state_->parameter = parameter_of(tolerance);
}

LibsvmRegression::~LibsvmRegression() = default;

void LibsvmRegression::load(std::span<const DriftPoint> window) {
  state_->model.reset();
  state_->samples.clear();
  state_->sample_pointers.clear();
  state_->targets.clear();
  for (const auto& point : window) {
    state_->samples.push_back(nodes_of(point.x));
    state_->targets.push_back(point.label);
  }
  for (auto& sample : state_->samples) state_->sample_pointers.push_back(sample.data());
}

void LibsvmRegression::train() {
  const svm_problem problem{.l = static_cast<int>(state_->samples.size()),
                            .y = state_->targets.data(),
                            .x = state_->sample_pointers.data()};
  if (const char* error = svm_check_parameter(&problem, &state_->parameter)) {
    throw std::runtime_error(std::string("LIBSVM: ") + error);
  }
  state_->model.reset(svm_train(&problem, &state_->parameter));
}

double LibsvmRegression::predict(const DriftFeatures& x) const {
  const Nodes nodes = nodes_of(x);
  return svm_predict(state_->model.get(), nodes.data());
}

std::string libsvm_version_text() {
  return std::to_string(libsvm_version / 100) + '.' + std::to_string(libsvm_version % 100);
}

#if ZERODRIFT_WITH_DLIB

namespace {

using DlibSample = dlib::matrix<double, kDriftFeatures, 1>;
using DlibKernel = dlib::radial_basis_kernel<DlibSample>;

DlibSample sample_of(const DriftFeatures& x) {
  DlibSample sample;
  for (std::size_t d = 0; d < kDriftFeatures; ++d) sample(static_cast<long>(d)) = x[d];
  return sample;
}

}  // namespace

struct DlibKrls::State {
  dlib::krls<DlibKernel> krls{DlibKernel(kRbfGamma)};
};

bool DlibKrls::is_built_in() {
  return true;
}

void DlibKrls::learn(const DriftPoint& point) {
  state_->krls.train(sample_of(point.x), point.label);
}

double DlibKrls::predict(const DriftFeatures& x) const {
  return state_->krls(sample_of(x));
}

#else

struct DlibKrls::State {};

bool DlibKrls::is_built_in() {
  return false;
}

void DlibKrls::learn(const DriftPoint& /*point*/) {
  throw std::logic_error("dlib::krls: not built in");
}

double DlibKrls::predict(const DriftFeatures& /*x*/) const {
  throw std::logic_error("dlib::krls: not built in");
}

#endif

DlibKrls::DlibKrls() : state_(std::make_unique<State>()) {}
DlibKrls::~DlibKrls() = default;
DlibKrls::DlibKrls(DlibKrls&&) noexcept = default;
DlibKrls& DlibKrls::operator=(DlibKrls&&) noexcept = default;

}  // namespace zerodrift::bench
