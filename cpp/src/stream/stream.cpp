#include "stream/stream.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {

template <class Real>
Stream<Real>::Stream(const Frame& frame, Topology caller_topology, DisconnectedRule rule,
                     Index threads, bool has_uncertainty)
    : topology(in_internal_order(std::move(caller_topology), numbering)),
      workers(threads),
      exchange(numbering, workers),
      generations(frame.size()),
      disconnected(*topology, rule),
      previous(frame.size()),
      current(frame.size()),
      known(frame.size()),
      age(frame.size()) {
  known_copy_.reserve(frame.size());
  if (!numbering.is_natural()) {
    generation_copy_.reserve(frame.size());
    age_copy_.reserve(frame.size());
  }
  if (has_uncertainty) standard_error_copy_.reserve(frame.size());
}

template <class Real>
typename Stream<Real>::Prepared Stream<Real>::prepare(const Frame& frame) const {
  Prepared prepared = {to_internal_order(numbering, frame), disconnected};
  prepared.disconnected.reset(prepared.first_frame);
  return prepared;
}

template <class Real>
void Stream<Real>::begin(Prepared prepared) noexcept {
  disconnected = std::move(prepared.disconnected);
  first_frame = std::move(prepared.first_frame);
  std::ranges::copy(first_frame, previous.begin());
  std::ranges::fill(known, std::uint8_t{1});
  generations.classify(topology->cells, known);
  std::ranges::fill(age, 0);
  n_frames = 0;
  forget_copies();
}

template <class Real>
void Stream<Real>::write(Points<Real> completed) {
  disconnected.complete(previous, current, generations);
  exchange.write(current, previous, completed);
}

template <class Real>
void Stream<Real>::advance() {
  std::swap(previous, current);
  for (std::size_t v = 0; v < age.size(); ++v) {
    const Index older = age[v] + (age[v] < std::numeric_limits<Index>::max() ? 1 : 0);
    age[v] = known[v] != 0 ? 0 : older;
  }
  if (n_frames < std::numeric_limits<std::size_t>::max()) ++n_frames;
  forget_copies();
}

template <class Real>
void Stream<Real>::recall(Frame last, std::vector<Index> ages, std::vector<std::uint8_t> mask,
                          std::size_t frames) {
  previous = std::move(last);
  age = std::move(ages);
  known = std::move(mask);
  generations.classify(topology->cells, known);
  n_frames = frames;
  forget_copies();
}

template <class Real>
void Stream<Real>::count(FrameReport& report) const {
  report.known = generations.anchors();
  report.filled = generations.reached();
  report.disconnected = generations.disconnected_vertices();
}

template <class Real>
void Stream<Real>::forget_copies() noexcept {
  known_copy_.clear();
  generation_copy_.clear();
  age_copy_.clear();
  standard_error_copy_.clear();
}

template <class Real>
template <class T>
std::span<const T> Stream<Real>::in_caller_order(std::span<const T> values,
                                                 std::vector<T>& copy) const {
  if (numbering.is_natural()) return values;
  if (copy.empty()) {
    copy.resize(values.size());  // within its capacity
    for (std::size_t i = 0; i < values.size(); ++i) copy[i] = values[numbering.internal_index(i)];
  }
  return copy;
}

template <class Real>
std::span<const std::uint8_t> Stream<Real>::known_of_caller() const {
  if (known_copy_.empty()) {
    known_copy_.resize(n_vertices());  // within its capacity
    for (std::size_t i = 0; i < n_vertices(); ++i) {
      const Index g = generations.of_vertices()[numbering.internal_index(i)];
      known_copy_[i] = g == Generations::anchor ? 1 : 0;
    }
  }
  return known_copy_;
}

template <class Real>
std::span<const Index> Stream<Real>::generation_of_caller() const {
  return in_caller_order<Index>(generations.of_vertices(), generation_copy_);
}

template <class Real>
std::span<const Index> Stream<Real>::age_of_caller() const {
  return in_caller_order<Index>(age, age_copy_);
}

template <class Real>
std::span<const Real> Stream<Real>::in_caller_order(std::span<const double> values) const {
  std::vector<Real>& copy = standard_error_copy_;
  if (copy.empty()) {
    copy.resize(values.size());  // within its capacity
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = values[numbering.internal_index(i)];
      copy[i] = std::isinf(value) ? std::numeric_limits<Real>::infinity() : saturated<Real>(value);
    }
  }
  return copy;
}

template class Stream<float>;
template class Stream<double>;

}  // namespace dynmesh
