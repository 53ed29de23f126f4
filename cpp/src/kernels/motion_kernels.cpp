#include "kernels/motion_kernels.hpp"

#include "base/length_limits.hpp"
#include "kernels/lanes.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

[[gnu::always_inline]] inline Doubles bounded(Doubles squares) {
  const Doubles ceiling = Doubles{} + squared_length_ceiling;
  const Doubles above = larger(squares, Doubles{} + squared_length_floor);
  return above < ceiling ? above : ceiling;
}

void weigh(const MotionRows& rows, const Vector3* previous, double scale, double* weights) {
  const MotionRows of = rows;  // which no write below can change
  double* end = weights;
  for (Index r = 0; r < of.n; ++r) {
    const Index j = of.rows[r];
    const Doubles here = quad(previous + j);
    for (Index i = of.offsets[j]; i < of.offsets[j + 1]; ++i) {
      const Doubles edge = scale * (quad(previous + of.neighbours[i]) - here);
      const Doubles squares = edge * edge;
      *end++ = squares[0] + squares[1] + squares[2];
    }
  }
  double* s = weights;
  for (; end - s >= lanes; s += lanes) store(s, 1 / bounded(load(s)));
  for (; s != end; ++s) *s = 1 / bounded(Doubles{} + *s)[0];
}

/// The sum over a cell of s times the motion.
[[gnu::always_inline]] inline Doubles sum_of(Index size, const Index* cell, const double* s,
                                             const double* moved) {
  Doubles sum{};
  for (Index i = 0; i < size; ++i) sum += s[i] * load(moved + std::ptrdiff_t{lanes} * cell[i]);
  return sum;
}

/// The same without a loop for the usual sizes. Rows of one size follow each other, so that the
/// processor foresees which one is next.
[[gnu::always_inline]] inline Doubles sum_of_cell(Index size, const Index* cell, const double* s,
                                                  const double* moved) {
  switch (size) {
    case 4:
      return sum_of(4, cell, s, moved);
    case 5:
      return sum_of(5, cell, s, moved);
    case 6:
      return sum_of(6, cell, s, moved);
    case 7:
      return sum_of(7, cell, s, moved);
    case 8:
      return sum_of(8, cell, s, moved);
    default:
      return sum_of(size, cell, s, moved);
  }
}

Index find_means(const MotionRows& rows, const double* weights, const double* moved, Index t,
                 bool revisits, double* means, Index* generation) {
  constexpr double smallest = 2.3e-308;
  const MotionRows of = rows;  // which no write below can change
  const double next = t + 1.0;
  Index reached = 0;
  const double* s = weights;
  for (Index r = 0; r < of.n; ++r) {
    const Index j = of.rows[r];
    const Index first = of.offsets[j];
    const Index size = of.offsets[j + 1] - first;
    const std::ptrdiff_t row = std::ptrdiff_t{lanes} * j;
    const Index g = generation[j];
    if (!revisits && g >= 0) {
      store(means + row, load(moved + row));
      ++reached;
    } else {
      const Doubles sum = sum_of_cell(size, of.neighbours + first, s, moved);
      // Without branches, since which vertices are reached may be random. Where nothing is known
      // yet, the sums are 0, whatever they are divided by.
      const Index is_reached{sum[3] > 0};
      const Index is_new = is_reached & Index{g < 0};
      const Index since = g + is_new * (t - g);
      generation[j] = since;
      reached += is_reached;
      // In the next iteration, w = t + 1 - g, divided by t + 1.
      const double w = (next - since) / (next * (sum[3] > smallest ? sum[3] : smallest));
      store(means + row, w * sum);
    }
    s += size;
  }
  return reached;
}

}  // namespace

extern const MotionKernels motion_kernels;
const MotionKernels motion_kernels = {weigh, find_means};

}  // namespace dynmesh::DYNMESH_KERNELS
