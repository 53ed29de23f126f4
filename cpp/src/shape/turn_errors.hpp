/// The part of standard errors that is due to components of which it is not known how they turn.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>

#include "frame/generations.hpp"
#include "shape/cluster_rotations.hpp"
#include "shape/memory.hpp"

namespace dynmesh {

/// Adds to the standard errors of a frame X how far satellites are off if their component, whose
/// anchors are near a line or in one place, turns otherwise than what leads it. `turns`
/// (components,) are those of the frame.
///
/// How much components turn otherwise, about an axis and in a frame, is learned from those whose
/// anchors tell it. The expected error of the rotation of a component is a symmetric matrix, of
/// which the eigenvalues are the expected angles about the eigenvectors. It grows by that much in a
/// frame, since what turns goes on to do so, and vanishes about the axes of which anchors tell.
void add_turn_errors(std::span<const ComponentRotation> turns, const Topology& topology,
                     const Generations& generations, Field x, const ErrorMemory& memory,
                     ErrorMemory& next);

}  // namespace dynmesh
