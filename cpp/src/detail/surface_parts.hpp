/// The parts of a surface that move on their own: overlapping regions around seeds.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"

namespace dynmesh {

/// The parts that hold each vertex, with weights. Vertex i has the entries offsets[i] to
/// offsets[i + 1] - 1. Part 0 is global: it holds every vertex with weight 1. The weights of the
/// others add up to 1 at every vertex that a seed reaches, and do not reach across components.
struct SurfaceParts {
  struct Entry {
    Index part;
    double weight;
  };
  Index n_parts = 1;
  std::vector<Index> offsets;  ///< (k + 1,)
  std::vector<Entry> entries;
};

/// Seeds are chosen on the frame by farthest points, the first of them farthest from the mean of
/// all vertices. The weight of a seed decreases with the shortest distance along the edges.
SurfaceParts divide_surface(const Cells& cells, std::span<const Vector3<double>> frame,
                            const TrainingConstants& constants);

}  // namespace dynmesh
