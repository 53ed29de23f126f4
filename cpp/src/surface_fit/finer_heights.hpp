/// How high a finer surface lies above the triangles of a coarse mesh of it.
#pragma once

#include <array>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "surface_fit/surface_places.hpp"

namespace dynmesh {

/// The heights in frame 0, which the finer surface keeps as both move.
class FinerHeights {
 public:
  /// None: there is no finer surface.
  FinerHeights() = default;
  /// `frame` of the coarse mesh, with these normals at its vertices, lies on `finer_frame`, which
  /// the boxes of `finer` contain.
  FinerHeights(std::span<const Triangle> faces, Field frame, Field normals, double mean_edge,
               const SurfacePlaces& finer, Field finer_frame, Workers& workers);

  [[nodiscard]] bool empty() const { return heights_.empty(); }
  /// Above a place: quadratic between the corners and the middles of the sides.
  [[nodiscard]] double at(const Place& place) const;
  /// The face of the finer surface above the middle of the nearest side of a place.
  [[nodiscard]] std::uint32_t face_near(const Place& place) const;

 private:
  std::vector<std::array<double, 3>> heights_;       // above the sides of the faces
  std::vector<std::array<std::uint32_t, 3>> faces_;  // there
};

}  // namespace dynmesh
