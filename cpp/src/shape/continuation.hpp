/// What the known rows of a frame show beyond the expected shape goes on into its holes; see
/// docs/method.md, "A frame".
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>

#include "frame/generations.hpp"

namespace dynmesh {

/// Adds to the expected `shape`, (k,) rows, where not all of a one-ring is known, a part of how
/// much the rows `found` beside it differ from theirs; the farther from these, the less. A row is
/// known if its vertex and all of its one-ring are, which may differ a little from the vertices of
/// K's intrinsic triangulation. Both are turned back to frame 0. `found` is overwritten.
void continue_into_holes(const Cells& cells, const Generations& generations,
                         std::span<Vector3> found, std::span<Vector3> shape);

}  // namespace dynmesh
