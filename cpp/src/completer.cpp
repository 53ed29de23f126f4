#include <algorithm>
#include <chrono>
#include <dynmesh/completer.hpp>
#include <dynmesh/motion.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "completer_arguments.hpp"
#include "detail.hpp"
#include "exchange.hpp"
#include "fast_motion.hpp"
#include "geometry.hpp"
#include "numbering.hpp"
#include "outliers.hpp"
#include "workers.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

/// The topology as it lies in memory.
std::unique_ptr<const Topology> in_places(Topology topology, Numbering& numbering) {
  numbering = choose_numbering(topology.cells);
  return std::make_unique<const Topology>(numbering.is_natural() ? std::move(topology)
                                                                 : renumber(topology, numbering));
}

std::vector<Triangle> faces_in_places(Faces faces, const Numbering& numbering) {
  std::vector<Triangle> placed(faces.count);
  for (std::size_t f = 0; f < faces.count; ++f) {
    std::ranges::transform(faces[f], placed[f].begin(), [&](Index v) {
      return static_cast<Index>(numbering.place(static_cast<std::size_t>(v)));
    });
  }
  return placed;
}

template <class Real>
std::unique_ptr<Estimator<Real>> estimator_of(Faces faces, const Numbering& numbering,
                                              const Topology& topology, const Settings& settings,
                                              Workers& workers) {
  if (settings.method == Method::detail) {
    return std::make_unique<Detail<Real>>(faces_in_places(faces, numbering), topology,
                                          settings.noise, workers);
  }
  const Cells& cells = topology.cells;
  if (settings.revisit && FastMotion<Real>::takes(cells.size())) {
    return std::make_unique<FastMotion<Real>>(cells, settings.extra_iterations, workers);
  }
  return std::make_unique<Motion<Real>>(cells, settings.revisit, settings.extra_iterations);
}

}  // namespace

template <class Real>
Completer<Real>::Completer(Faces faces, Points<const Real> first_frame, const Settings& settings)
    : settings_((check_settings(settings), settings)),
      first_frame_(first_frame_of(first_frame)),
      numbering_(std::make_unique<Numbering>()),
      topology_(in_places(topology_of(faces, first_frame.count), *numbering_)),
      workers_(std::make_unique<Workers>(settings.threads)),
      exchange_(std::make_unique<Exchange<Real>>(*numbering_, *workers_)),
      generations_(first_frame.count),
      outliers_(settings.reject_outliers ? std::make_unique<Outliers<Real>>(topology_->cells)
                                         : nullptr),
      estimator_(estimator_of<Real>(faces, *numbering_, *topology_, settings, *workers_)),
      unseen_(*topology_, settings.unseen),
      previous_(first_frame.count),
      current_(first_frame.count),
      known_(first_frame.count),
      age_(first_frame.count) {
  if (!numbering_->is_natural()) {
    generation_for_caller_.reserve(first_frame.count);
    age_for_caller_.reserve(first_frame.count);
  }
  begin(to_places(*numbering_, first_frame_));
}

template <class Real>
Completer<Real>::~Completer() = default;
template <class Real>
Completer<Real>::Completer(Completer&&) noexcept = default;
template <class Real>
Completer<Real>& Completer<Real>::operator=(Completer&&) noexcept = default;

/// Where memory runs out, everything is as it was.
template <class Real>
void Completer<Real>::begin(std::vector<Vector3<Real>> first_frame) {
  Unseen<Real> unseen = unseen_;
  unseen.reset(first_frame);
  estimator_->reset(first_frame);
  // From here on nothing fails.
  unseen_ = std::move(unseen);
  if (outliers_) outliers_->reset(first_frame);
  std::ranges::copy(first_frame, previous_.begin());
  first_frame_ = std::move(first_frame);
  std::ranges::fill(known_, std::uint8_t{1});
  generations_.classify(topology_->cells, known_);
  std::ranges::fill(age_, 0);
  generation_for_caller_.clear();
  age_for_caller_.clear();
  report_ = {};
  report_.known = n_vertices();
}

template <class Real>
void Completer<Real>::reset(Points<const Real> frame) {
  check_rows("frame", frame, n_vertices());
  begin(to_places(*numbering_, complete_frame("frame", frame)));
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, KnownMask known,
                                  Points<Real> completed) {
  const auto start = Clock::now();
  check_rows("points", points, n_vertices());
  check_rows("known", known, n_vertices());
  check_output(completed, n_vertices(),
               {{"points", Extent::of(points)}, {"known", Extent::of(known)}});
  read(points, known);
  return complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, Points<Real> completed) {
  const auto start = Clock::now();
  check_rows("points", points, n_vertices());
  check_output(completed, n_vertices(), {{"points", Extent::of(points)}});
  read(points, {});
  return complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::push_sparse(std::span<const Index> indices, Points<const Real> points,
                                         Points<Real> completed) {
  const auto start = Clock::now();
  if (indices.size() != points.count) {
    throw std::invalid_argument("points: has " + std::to_string(points.count) + " rows for " +
                                std::to_string(indices.size()) + " indices");
  }
  check_view("points", points);
  check_output(completed, n_vertices(),
               {{"indices", Extent::of(indices)}, {"points", Extent::of(points)}});
  std::ranges::fill(known_, std::uint8_t{0});
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Index index = indices[i];
    if (index < 0 || static_cast<std::size_t>(index) >= n_vertices()) {
      throw std::invalid_argument("indices: place " + std::to_string(i) + " holds " +
                                  std::to_string(index) + ", but the mesh has " +
                                  std::to_string(n_vertices()) + " vertices, counted from 0");
    }
    const std::size_t v = numbering_->place(static_cast<std::size_t>(index));
    if (known_[v] != 0) {
      const auto first = std::ranges::find(indices, index) - indices.begin();
      throw std::invalid_argument("indices: places " + std::to_string(first) + " and " +
                                  std::to_string(i) + " both hold vertex " + std::to_string(index));
    }
    known_[v] = 1;
    current_[v] = row(points, i);
    check_known_position(i, current_[v]);
  }
  return complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::skip(Points<Real> completed) {
  const auto start = Clock::now();
  check_output(completed, n_vertices(), {});
  std::ranges::fill(known_, std::uint8_t{0});
  return complete(completed, start);
}

/// Takes a row for each vertex; without a mask those that are finite are anchors.
template <class Real>
void Completer<Real>::read(Points<const Real> points, KnownMask known) {
  if (exchange_->read(points, known, current_, known_)) return;
  for (std::size_t i = 0; i < points.count; ++i) {  // one of them is out of range
    if (known_[numbering_->place(i)] != 0) check_known_position(i, row(points, i));
  }
}

/// Algorithm 1 of the paper for one frame, whose anchors stand in known_ and current_. The calls
/// above have checked everything, so that only the estimate can fail, for lack of memory: nothing
/// that outlives the call changes before it is there.
template <class Real>
FrameReport Completer<Real>::complete(Points<Real> completed, Clock::time_point start) {
  const std::size_t rejected = outliers_ ? outliers_->drop(previous_, current_, known_) : 0;
  // Anchors, satellites and unseen vertices; eq. (3), (4).
  const Index iterations = estimator_->estimate(previous_, current_, known_, generations_);
  unseen_.place(previous_, current_, generations_);
  // Where the recursion diverges, it must not end in a NaN that never leaves: such a vertex stays.
  exchange_->write(current_, previous_, completed);
  for (std::size_t v = 0; v < n_vertices(); ++v) {
    const Index older = age_[v] + (age_[v] < std::numeric_limits<Index>::max() ? 1 : 0);
    age_[v] = known_[v] != 0 ? 0 : older;
  }
  generation_for_caller_.clear();
  age_for_caller_.clear();
  estimator_->remember(current_);
  std::swap(previous_, current_);
  report_.rejected = rejected;
  report_.known = generations_.anchors();
  report_.filled = generations_.reached();
  report_.unseen = generations_.unseen_vertices();
  report_.iterations = static_cast<std::size_t>(iterations);
  report_.stages = estimator_->stages();
  report_.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  return report_;
}

template <class Real>
std::span<const Index> Completer<Real>::in_caller_order(std::span<const Index> values,
                                                        std::vector<Index>& copy) const {
  if (numbering_->is_natural()) return values;
  if (copy.empty()) {
    copy.resize(values.size());  // within its capacity
    for (std::size_t i = 0; i < values.size(); ++i) copy[i] = values[numbering_->place(i)];
  }
  return copy;
}

template <class Real>
std::span<const Index> Completer<Real>::generation() const {
  return in_caller_order(generations_.of_vertices(), generation_for_caller_);
}

template <class Real>
std::span<const Index> Completer<Real>::age() const {
  return in_caller_order(age_, age_for_caller_);
}

template class Completer<float>;
template class Completer<double>;

}  // namespace dynmesh
