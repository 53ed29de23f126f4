/// Where the components of a mesh are near each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// Chooses at most `n` of the vertices, each the one that is farthest from those before it.
std::vector<std::uint32_t> spread(const std::vector<std::uint32_t>& vertices, std::size_t n,
                                  Field x);

/// Returns (k,) the nearest vertex of another component, or -1 if there is only one component. Of
/// several, any, but always the same one. The time is about k log k, times the logarithm of the
/// number of components.
std::vector<Index> find_donors(Field frame, std::span<const Index> component);

/// Two vertices of different components whose difference is kept.
struct Tie {
  std::uint32_t i = 0;
  std::uint32_t j = 0;
  double weight = 0;
  Vector3 kept{};  ///< X_i - X_j in frame 0
};

/// Ties some of the vertices of each component that are nearest to others in frame 0, well spread,
/// each to the nearest vertex of another component. None for a single component. `weight` is that
/// of vertices that touch.
std::vector<Tie> find_ties(const Topology& topology, Field first_frame, double mean_edge,
                           double weight);

/// How many pairs of components can be tied, whatever their frame 0.
std::size_t most_tied_pairs(std::size_t components);

/// Ties vertices to those of the other side of a wall that is thinner than a mean edge, well
/// spread: the nearest vertex of the same component that lies behind it and whose normal is about
/// the opposite. The weight falls with the distance as that of other ties. `normals` (k,) point
/// outwards.
std::vector<Tie> find_walls(const Topology& topology, Field first_frame, Field normals,
                            double mean_edge, double thickness, double weight);

}  // namespace dynmesh
