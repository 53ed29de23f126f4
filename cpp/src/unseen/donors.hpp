/// For each vertex the nearest vertex of another component.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// (k,) the nearest vertex of another component, the one of smallest index among equals; -1 where
/// there is one component only. About k log k.
template <class Real>
std::vector<Index> find_donors(std::span<const Vector3<Real>> frame,
                               std::span<const Index> component);

}  // namespace dynmesh
