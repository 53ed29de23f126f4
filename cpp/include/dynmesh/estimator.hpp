/// The seam between the completer and its methods.
#pragma once

#include <cstdint>
#include <dynmesh/generations.hpp>
#include <dynmesh/types.hpp>
#include <span>

namespace dynmesh {

/// One way to estimate the satellites of a frame. Frames have one Vector3 per vertex.
template <class Real>
class Estimator {
 public:
  using Frame = std::span<const Vector3<Real>>;

  Estimator() = default;
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;
  Estimator(Estimator&&) = delete;
  Estimator& operator=(Estimator&&) = delete;
  virtual ~Estimator() = default;

  /// Begins a sequence whose frame 0 is `first_frame`.
  virtual void reset(Frame first_frame) = 0;

  /// Classifies the vertices and fills in the satellites of `points`, where the anchors, those with
  /// `known[v] == 1` and not 0, already stand, from them and from the previous completed frame.
  /// Unseen vertices are left alone. Returns the number of iterations.
  virtual Index estimate(Frame previous, std::span<Vector3<Real>> points,
                         std::span<const std::uint8_t> known, Generations& generations) = 0;

  /// Takes note of a completed frame, unseen vertices and all, before the next `estimate`.
  virtual void remember(Frame completed) = 0;
};

}  // namespace dynmesh
