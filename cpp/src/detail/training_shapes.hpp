/// The modes of a training sequence.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>

#include "detail/constants.hpp"
#include "detail/detail_operator.hpp"
#include "detail/modes.hpp"
#include "detail/rounding.hpp"
#include "detail/surface_parts.hpp"
#include "mesh/training_frames.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Returns the modes of the shapes z = Q^T K V - m_0 of the frames V, in the axes of frame 0, which
/// is `first` and has the operator `k`. Those of a moved and turned sequence are the same.
Modes training_modes(const TrainingFrames& training, const SurfaceParts& parts,
                     const DetailOperator& k, const Cells& cells,
                     std::span<const Vector3<double>> first, double mean_edge,
                     const Rounding& rounding, const DetailConstants& constants, Workers& workers);

}  // namespace dynmesh
