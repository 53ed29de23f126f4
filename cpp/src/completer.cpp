#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <dynmesh/completer.hpp>
#include <dynmesh/motion.hpp>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "fast_motion.hpp"
#include "geometry.hpp"
#include "overlap.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

template <class Real>
Vector3<Real> row(const Points<const Real>& points, std::size_t i) {
  return {points(i, 0), points(i, 1), points(i, 2)};
}

/// Calls `visit` with a view that has the same rows, and constant strides if they are the usual.
template <class Real, class Visit>
void with_strides(const Points<Real>& points, Visit&& visit) {
  if (points.row_stride == 3 && points.column_stride == 1) {
    visit([data = points.data](std::size_t row, std::size_t column) -> Real& {
      return data[3 * row + column];
    });
  } else {
    visit(points);
  }
}

template <class Real>
std::string to_text(const Vector3<Real>& v) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "(%.9g, %.9g, %.9g)", static_cast<double>(v.x),
                static_cast<double>(v.y), static_cast<double>(v.z));
  return text.data();
}

/// Larger coordinates are refused: times the largest weights of eq. (4) they would run out of Real,
/// and a position that is not finite would spread over the mesh and stay.
template <class Real>
constexpr Real largest_coordinate = std::is_same_v<Real, float> ? Real(1e18) : Real(1e200);

template <class Real>
bool is_in_range(const Vector3<Real>& v) {
  // No branches, since this is asked of every vertex in every frame.
  const int x = std::abs(v.x) <= largest_coordinate<Real> ? 1 : 0;
  const int y = std::abs(v.y) <= largest_coordinate<Real> ? 1 : 0;
  const int z = std::abs(v.z) <= largest_coordinate<Real> ? 1 : 0;
  return (x & y & z) != 0;
}

/// `place`: which row or vertex of the argument is at `v`.
template <class Real>
void check_position(const char* argument, const char* place, std::size_t number,
                    const Vector3<Real>& v, const char* rule) {
  if (is_in_range(v)) return;
  std::string message = std::string(argument) + ": " + place + " " + std::to_string(number) +
                        " is at " + to_text(v) + ", but " + rule;
  if (is_finite(v)) message += " and below 1e" + std::string(sizeof(Real) == 4 ? "18" : "200");
  throw std::invalid_argument(message);
}

template <class Real>
void check_known_position(std::size_t row, const Vector3<Real>& position) {
  check_position("points", "row", row, position, "known positions must be finite");
}

template <class Real>
std::vector<Vector3<Real>> complete_frame(const char* argument, Points<const Real> points) {
  std::vector<Vector3<Real>> frame(points.count);
  for (std::size_t v = 0; v < points.count; ++v) {
    frame[v] = row(points, v);
    check_position(argument, "vertex", v, frame[v], "this frame must be complete and finite");
  }
  return frame;
}

void check_rows(const char* argument, const void* data, std::size_t rows, std::size_t n_vertices) {
  if (rows != n_vertices) {
    throw std::invalid_argument(std::string(argument) + ": has " + std::to_string(rows) +
                                " rows, but the mesh has " + std::to_string(n_vertices) +
                                " vertices");
  }
  if (rows > 0 && data == nullptr) {
    throw std::invalid_argument(std::string(argument) + ": is a null pointer");
  }
}

struct NamedExtent {
  const char* name = "";
  Extent extent;
};

/// The completed frame must not overlap any of `inputs`, unless it is the very same array.
template <class Real>
void check_output(const Points<Real>& completed, std::size_t n_vertices,
                  std::initializer_list<NamedExtent> inputs) {
  check_rows("out", completed.data, completed.count, n_vertices);
  const Extent output = Extent::of(completed);
  if (overlaps_itself(output)) {
    throw std::invalid_argument("out: the rows of the completed frame overlap one another");
  }
  for (const auto& input : inputs) {
    if (input.extent != output && overlap(input.extent, output)) {
      throw std::invalid_argument(std::string("out: the completed frame overlaps ") + input.name +
                                  "; it may be the same array as points, or one apart");
    }
  }
}

template <class Real>
std::vector<Vector3<Real>> first_frame_of(Points<const Real> points) {
  if (points.count == 0) throw std::invalid_argument("first_frame: has no vertices");
  check_rows("first_frame", points.data, points.count, points.count);
  return complete_frame("first_frame", points);
}

Topology topology_of(Faces faces, std::size_t n_vertices) {
  if (faces.count == 0) {
    throw std::invalid_argument("faces: is empty, but completion needs the mesh's connectivity");
  }
  check_rows("faces", faces.data, faces.count, faces.count);
  return build_topology(faces, n_vertices);
}

template <class Real>
std::unique_ptr<Estimator<Real>> estimator_of(const Cells& cells, const Settings& settings) {
  if (settings.revisit && FastMotion<Real>::takes(cells.size())) {
    return std::make_unique<FastMotion<Real>>(cells, settings.extra_iterations);
  }
  return std::make_unique<Motion<Real>>(cells, settings.revisit, settings.extra_iterations);
}

}  // namespace

template <class Real>
Completer<Real>::Completer(Faces faces, Points<const Real> first_frame, const Settings& settings)
    : settings_((check_settings(settings), settings)),
      first_frame_(first_frame_of(first_frame)),
      topology_(std::make_unique<const Topology>(topology_of(faces, first_frame.count))),
      generations_(first_frame.count),
      estimator_(estimator_of<Real>(topology_->cells, settings)),
      unseen_(*topology_, settings.unseen),
      current_(first_frame.count),
      known_(first_frame.count),
      age_(first_frame.count) {
  begin(first_frame_);
}

template <class Real>
Completer<Real>::~Completer() = default;
template <class Real>
Completer<Real>::Completer(Completer&&) noexcept = default;
template <class Real>
Completer<Real>& Completer<Real>::operator=(Completer&&) noexcept = default;

template <class Real>
void Completer<Real>::begin(const std::vector<Vector3<Real>>& first_frame) {
  unseen_.reset(first_frame);
  estimator_->reset(first_frame);
  first_frame_ = first_frame;
  previous_ = first_frame;
  std::ranges::fill(known_, std::uint8_t{1});
  generations_.classify(topology_->cells, known_);
  std::ranges::fill(age_, 0);
  report_ = {};
  report_.known = n_vertices();
}

template <class Real>
void Completer<Real>::reset(Points<const Real> frame) {
  check_rows("frame", frame.data, frame.count, n_vertices());
  begin(complete_frame("frame", frame));
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, KnownMask known,
                                  Points<Real> completed) {
  const auto start = Clock::now();
  check_rows("points", points.data, points.count, n_vertices());
  check_rows("known", known.data, known.count, n_vertices());
  check_output(completed, n_vertices(),
               {{"points", Extent::of(points)}, {"known", Extent::of(known)}});
  read(points, [&](std::size_t v, const Vector3<Real>&) { return known[v]; });
  return complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, Points<Real> completed) {
  const auto start = Clock::now();
  check_rows("points", points.data, points.count, n_vertices());
  check_output(completed, n_vertices(), {{"points", Extent::of(points)}});
  read(points, [](std::size_t, const Vector3<Real>& position) { return is_finite(position); });
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
  check_rows("points", points.data, points.count, points.count);
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
    const auto v = static_cast<std::size_t>(index);
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

/// Takes a row for each vertex; `is_observed(vertex, position)` says which are anchors.
template <class Real>
template <class Predicate>
void Completer<Real>::read(Points<const Real> points, Predicate&& is_observed) {
  unsigned out_of_range = 0;
  with_strides(points, [&](const auto& at) {
    for (std::size_t v = 0; v < points.count; ++v) {
      const Vector3<Real> position = {at(v, 0), at(v, 1), at(v, 2)};
      const unsigned observed = is_observed(v, position) ? 1 : 0;
      known_[v] = static_cast<std::uint8_t>(observed);
      current_[v] = position;  // of no meaning if it was not observed
      out_of_range |= observed & (is_in_range(position) ? 0U : 1U);
    }
  });
  for (std::size_t v = 0; out_of_range != 0 && v < points.count; ++v) {
    if (known_[v] != 0) check_known_position(v, current_[v]);
  }
}

/// Algorithm 1 of the paper for one frame, whose anchors stand in known_ and current_. Nothing in
/// here fails, so the calls above have checked everything before the first change of state.
template <class Real>
FrameReport Completer<Real>::complete(Points<Real> completed, Clock::time_point start) {
  // Anchors, satellites and unseen vertices; eq. (3), (4).
  const Index iterations = estimator_->estimate(previous_, current_, known_, generations_);
  unseen_.place(previous_, current_, generations_);
  with_strides(completed, [&](const auto& at) {
    for (std::size_t v = 0; v < n_vertices(); ++v) {
      // Where the recursion diverges, it must not end in a NaN that never leaves.
      if (!is_in_range(current_[v])) [[unlikely]]
        current_[v] = previous_[v];
      at(v, 0) = current_[v].x;
      at(v, 1) = current_[v].y;
      at(v, 2) = current_[v].z;
    }
  });
  for (std::size_t v = 0; v < n_vertices(); ++v) {
    age_[v] = known_[v] != 0 ? 0 : age_[v] + 1;
  }
  estimator_->remember(current_);
  std::swap(previous_, current_);
  report_.known = generations_.anchors();
  report_.filled = generations_.reached();
  report_.unseen = generations_.unseen_vertices();
  report_.iterations = static_cast<std::size_t>(iterations);
  report_.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  return report_;
}

template class Completer<float>;
template class Completer<double>;

}  // namespace dynmesh
