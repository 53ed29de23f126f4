/// Finds the nearest vertex of another component for each vertex.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// Returns (k,) the nearest vertex of another component, or -1 if there is only one component. Ties
/// are resolved in favour of the smallest index. The time is about k log k.
template <class Real>
std::vector<Index> find_donors(std::span<const Vector3<Real>> frame,
                               std::span<const Index> component);

}  // namespace dynmesh
