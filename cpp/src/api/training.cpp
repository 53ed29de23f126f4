#include <dynmesh/training.hpp>
#include <string>
#include <utility>

#include "base/arguments.hpp"
#include "base/default_arithmetic.hpp"

namespace dynmesh {

template <class Real>
Training<Real>::Training(std::size_t n_vertices) : n_vertices_(n_vertices) {}

template <class Real>
void Training<Real>::add(Points<const Real> frame) {
  const DefaultArithmetic arithmetic;
  const std::string name = "training: frame " + std::to_string(n_added_);
  check_rows(name.c_str(), frame, n_vertices_);
  std::vector<Real> positions;
  positions.reserve(3 * n_vertices_);
  for (std::size_t v = 0; v < n_vertices_; ++v) {
    (void)checked_row(name.c_str(), "vertex", frame, v,
                      "every frame of a training sequence must be complete and finite");
    positions.insert(positions.end(), {frame(v, 0), frame(v, 1), frame(v, 2)});
  }
  if (n_added_ % interval_ == 0) {
    if (frames_.size() == most_frames) {
      // Keep every second frame. The number of frames is odd, so the next one fits behind them.
      for (std::size_t i = 0; 2 * i < frames_.size(); ++i) std::swap(frames_[i], frames_[2 * i]);
      frames_.resize((frames_.size() + 1) / 2);
      interval_ *= 2;
    }
    if (n_added_ % interval_ == 0) frames_.push_back(std::move(positions));
  }
  ++n_added_;
}

template class Training<float>;
template class Training<double>;

}  // namespace dynmesh
