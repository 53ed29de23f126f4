/// The inner loops of products with the modes of a training sequence, optimised for each kind of
/// processor; see kernels.hpp.
#pragma once

#include <dynmesh/types.hpp>

namespace dynmesh {

/// The number of modes of a part. Parts with fewer modes are filled up with zeros.
constexpr int modes_of_part = 16;

/// The modes of all parts at each vertex. Vertex i has the entries offsets[i] to offsets[i + 1] -
/// 1, one for each part that holds it. Entry e is in part parts[e] and has 3 * modes_of_part
/// numbers: the x of all modes, then the y, then the z.
struct ModeData {
  const Index* offsets;
  const Index* parts;
  const float* values;
};

/// The most shapes of which modes are made: those of the longest training.
constexpr int most_shapes = 76;

/// Shapes in slots, whose number is a multiple of four: vertex i has 3 * slots numbers, the x of
/// all slots, then the y, then the z. `weights` are those of the entries of ModeData.
struct ShapeData {
  const float* shapes;
  Index slots;
  const float* weights;
};

/// Which modes to form of which slots. Mode j of part p is the sum over l of the shape in slots[l]
/// times combinations[(p * n_slots + l) * modes_of_part + j].
struct CombinationData {
  const Index* slots;
  Index n_slots;
  const float* combinations;
};

/// `coefficients` and `sums` have modes_of_part numbers for each part.
struct ModeKernels {
  /// Sets rows `first` to `last` - 1 of `combined` to the sum of the modes times the coefficients.
  void (*combine)(const ModeData& modes, const float* coefficients, Vector3* combined, Index first,
                  Index last);
  /// Adds to `sums` the products of the modes with `field` in rows `first` to `last` - 1 and,
  /// unless `weights` is null, to `squares` the squared norms of the modes times the weights. The
  /// modes are read once for both.
  void (*project)(const ModeData& modes, const Vector3* field, const double* weights, float* sums,
                  float* squares, Index first, Index last);
  /// Sets the values of the modes of vertices `first` to `last` - 1, times the weights.
  void (*form)(const ModeData& modes, const ShapeData& shapes, const CombinationData& combinations,
               float* values, Index first, Index last);
  /// Adds to `sums`, which have a number for each slot of each part, the weighted products of the
  /// shape in `slot` with all shapes at vertices `first` to `last` - 1.
  void (*add_products)(const ModeData& modes, const ShapeData& shapes, Index slot, double* sums,
                       Index first, Index last);
};

}  // namespace dynmesh
