#include "completer/parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "completer/training_frames.hpp"
#include "detail/detail.hpp"
#include "motion/fast_motion.hpp"
#include "motion/motion.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

template <class Real>
std::unique_ptr<Estimator<Real>> estimator_of(Faces faces, const Numbering& numbering,
                                              const Topology& topology, const Settings& settings,
                                              Workers& workers,
                                              std::span<const std::vector<Real>> training) {
  if (settings.method == Method::detail) {
    return std::make_unique<Detail<Real>>(faces_in_internal_order(faces, numbering), topology,
                                          settings.noise, workers, DetailConstants{},
                                          take_in_internal_order<Real>(training, numbering),
                                          settings.learn, settings.uncertainty);
  }
  const Cells& cells = topology.cells;
  if (settings.revisit && FastMotion<Real>::supports(cells.size())) {
    return std::make_unique<FastMotion<Real>>(cells, settings.extra_iterations, workers);
  }
  return std::make_unique<Motion<Real>>(cells, settings.revisit, settings.extra_iterations);
}

}  // namespace

template <class Real>
Completer<Real>::Parts::Parts(Faces faces, const Frame& frame, Topology caller_topology,
                              const Settings& chosen, std::span<const std::vector<Real>> training)
    : settings(chosen),
      topology(in_internal_order(std::move(caller_topology), numbering)),
      workers(chosen.threads),
      exchange(numbering, workers),
      outliers(chosen.reject_outliers ? std::make_unique<Outliers<Real>>(topology->cells)
                                      : nullptr),
      generations(frame.size()),
      estimator(estimator_of<Real>(faces, numbering, *topology, chosen, workers, training)),
      disconnected(*topology, chosen.disconnected),
      previous(frame.size()),
      current(frame.size()),
      known(frame.size()),
      age(frame.size()),
      training_hash(hash_of_frames(training)) {
  if (!numbering.is_natural()) {
    generation_for_caller_.reserve(frame.size());
    age_for_caller_.reserve(frame.size());
  }
  if (chosen.uncertainty) standard_error_for_caller_.reserve(frame.size());
  begin(to_internal_order(numbering, frame));
}

template <class Real>
void Completer<Real>::Parts::begin(Frame new_first_frame) {
  Disconnected<Real> new_disconnected = disconnected;
  new_disconnected.reset(new_first_frame);
  estimator->reset(new_first_frame);
  // Nothing below can throw.
  disconnected = std::move(new_disconnected);
  if (outliers) outliers->reset(new_first_frame);
  std::ranges::copy(new_first_frame, previous.begin());
  first_frame = std::move(new_first_frame);
  std::ranges::fill(known, std::uint8_t{1});
  generations.classify(topology->cells, known);
  std::ranges::fill(age, 0);
  generation_for_caller_.clear();
  age_for_caller_.clear();
  standard_error_for_caller_.clear();
  n_frames = 0;
  report = {};
  report.known = n_vertices();
}

template <class Real>
std::span<const Index> Completer<Real>::Parts::in_caller_order(std::span<const Index> values,
                                                               std::vector<Index>& copy) const {
  if (numbering.is_natural()) return values;
  if (copy.empty()) {
    copy.resize(values.size());  // within its capacity
    for (std::size_t i = 0; i < values.size(); ++i) copy[i] = values[numbering.internal_index(i)];
  }
  return copy;
}

template <class Real>
std::span<const Index> Completer<Real>::Parts::generation() const {
  return in_caller_order(generations.of_vertices(), generation_for_caller_);
}

template <class Real>
std::span<const Index> Completer<Real>::Parts::age_of_vertices() const {
  return in_caller_order(age, age_for_caller_);
}

template <class Real>
std::span<const Real> Completer<Real>::Parts::standard_error() const {
  const std::span<const double> values = estimator->standard_error();
  std::vector<Real>& copy = standard_error_for_caller_;
  if (copy.empty()) {
    copy.resize(values.size());  // within its capacity
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = values[numbering.internal_index(i)];
      copy[i] = std::isinf(value) ? std::numeric_limits<Real>::infinity() : saturated<Real>(value);
    }
  }
  return copy;
}

template <class Real>
double Completer<Real>::Parts::mean_standard_error() const {
  const std::span<const double> values = estimator->standard_error();
  const std::span<const Index> generation = generations.of_vertices();
  double sum = 0;
  for (std::size_t v = 0; v < values.size(); ++v) {
    if (generation[v] > 0) sum += values[v] * values[v];
  }
  return sum > 0 ? std::sqrt(sum / static_cast<double>(generations.reached())) : 0;
}

#define DYNMESH_INSTANTIATE(Real)                                                        \
  template Completer<Real>::Parts::Parts(Faces, const Frame&, Topology, const Settings&, \
                                         std::span<const std::vector<Real>>);            \
  template void Completer<Real>::Parts::begin(Frame);                                    \
  template std::span<const Index> Completer<Real>::Parts::generation() const;            \
  template std::span<const Index> Completer<Real>::Parts::age_of_vertices() const;       \
  template std::span<const Real> Completer<Real>::Parts::standard_error() const;         \
  template double Completer<Real>::Parts::mean_standard_error() const;
DYNMESH_INSTANTIATE(float)
DYNMESH_INSTANTIATE(double)
#undef DYNMESH_INSTANTIATE

}  // namespace dynmesh
