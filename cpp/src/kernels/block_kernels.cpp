#include "kernels/block_kernels.hpp"

#include "kernels/lanes.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

using Single [[gnu::vector_size(4 * lanes), gnu::may_alias, gnu::aligned(4)]] = float;
static_assert(rows_of_block % lanes == 0);

/// Four numbers of each coordinate, and as many quads with these coordinates and 0.
struct Coordinates {
  Doubles x, y, z;
};
struct Quads {
  Doubles row[4];
};

[[gnu::always_inline]] inline Quads quads_of(const Coordinates& c) {
  const Doubles even = __builtin_shufflevector(c.x, c.y, 0, 4, 2, 6);
  const Doubles odd = __builtin_shufflevector(c.x, c.y, 1, 5, 3, 7);
  const Doubles even_z = __builtin_shufflevector(c.z, Doubles{}, 0, 4, 2, 5);
  const Doubles odd_z = __builtin_shufflevector(c.z, Doubles{}, 1, 4, 3, 5);
  return {{__builtin_shufflevector(even, even_z, 0, 1, 4, 5),
           __builtin_shufflevector(odd, odd_z, 0, 1, 4, 5),
           __builtin_shufflevector(even, even_z, 2, 3, 6, 7),
           __builtin_shufflevector(odd, odd_z, 2, 3, 6, 7)}};
}

[[gnu::always_inline]] inline Coordinates coordinates_of(const Quads& q) {
  const Doubles first = __builtin_shufflevector(q.row[0], q.row[1], 0, 4, 2, 6);  // x x z z
  const Doubles last = __builtin_shufflevector(q.row[2], q.row[3], 0, 4, 2, 6);
  const Doubles first_y = __builtin_shufflevector(q.row[0], q.row[1], 1, 5, 3, 7);
  const Doubles last_y = __builtin_shufflevector(q.row[2], q.row[3], 1, 5, 3, 7);
  return {__builtin_shufflevector(first, last, 0, 1, 4, 5),
          __builtin_shufflevector(first_y, last_y, 0, 1, 4, 5),
          __builtin_shufflevector(first, last, 2, 3, 6, 7)};
}

/// The numbers of a block that begin at `from`, in double precision.
[[gnu::always_inline]] inline Doubles widened(const float* from) {
  return __builtin_convertvector(*reinterpret_cast<const Single*>(from), Doubles);
}

void subtract(const float* blocks, Index n, Index columns, const double* x, const Index* rows,
              double* values) {
  constexpr int parts = rows_of_block / lanes;
  for (Index r = 0; r < n; r += rows_of_block, blocks += rows_of_block * columns) {
    Doubles sums[3][parts] = {};
    for (Index j = 0; j < columns; ++j) {
      for (int p = 0; p < parts; ++p) {
        const Doubles l = widened(blocks + rows_of_block * j + lanes * p);
        for (int f = 0; f < 3; ++f) sums[f][p] += x[4 * j + f] * l;
      }
    }
    double products[3][rows_of_block];
    for (int f = 0; f < 3; ++f) {
      for (int p = 0; p < parts; ++p) store(products[f] + lanes * p, sums[f][p]);
    }
    for (Index i = 0; i < rows_of_block && r + i < n; i += 4) {
      const Quads q =
          quads_of({load(products[0] + i), load(products[1] + i), load(products[2] + i)});
      for (Index h = 0; h < 4 && r + i + h < n; ++h) {
        double* y = values + std::ptrdiff_t{4} * rows[r + i + h];
        store(y, load(y) - q.row[h]);
      }
    }
  }
}

/// The rows that `subtract_transposed` takes at once, which then stay in the first-level
/// cache.
constexpr Index rows_at_once = 32 * rows_of_block;

/// Subtracts what `width` columns of some blocks contribute.
template <int width>
[[gnu::always_inline]] inline void subtract_columns(const float* blocks, Index n_blocks,
                                                    Index columns,
                                                    const double (&own)[3][rows_at_once],
                                                    double* x) {
  Doubles sums[width][3] = {};
  for (Index b = 0; b < n_blocks; ++b, blocks += rows_of_block * columns) {
    for (int p = 0; p < rows_of_block; p += lanes) {
      Doubles y[3];
      for (int f = 0; f < 3; ++f) y[f] = load(own[f] + rows_of_block * b + p);
      for (int w = 0; w < width; ++w) {
        const Doubles l = widened(blocks + rows_of_block * w + p);
        for (int f = 0; f < 3; ++f) sums[w][f] += l * y[f];
      }
    }
  }
  for (int w = 0; w < width; ++w) {
    const Quads q = quads_of({sums[w][0], sums[w][1], sums[w][2]});
    store(x + 4 * w, load(x + 4 * w) - ((q.row[0] + q.row[1]) + (q.row[2] + q.row[3])));
  }
}

void subtract_transposed(const float* blocks, Index n, Index columns, double* x, const Index* rows,
                         const double* values) {
  for (Index begin = 0; begin < n; begin += rows_at_once, blocks += rows_at_once * columns) {
    const Index end = begin + rows_at_once < n ? begin + rows_at_once : n;
    const Index n_blocks = (end - begin + rows_of_block - 1) / rows_of_block;
    double own[3][rows_at_once];
    for (Index r = begin; r < begin + rows_of_block * n_blocks; r += 4) {
      Quads q = {};
      for (Index h = 0; h < 4 && r + h < n; ++h) {
        q.row[h] = load(values + std::ptrdiff_t{4} * rows[r + h]);
      }
      const Coordinates c = coordinates_of(q);
      store(own[0] + r - begin, c.x);
      store(own[1] + r - begin, c.y);
      store(own[2] + r - begin, c.z);
    }
    Index j = 0;
    for (; j + 4 <= columns; j += 4) {
      subtract_columns<4>(blocks + rows_of_block * j, n_blocks, columns, own, x + 4 * j);
    }
    for (; j < columns; ++j) {
      subtract_columns<1>(blocks + rows_of_block * j, n_blocks, columns, own, x + 4 * j);
    }
  }
}

}  // namespace

extern const BlockKernels block_kernels;
const BlockKernels block_kernels = {subtract, subtract_transposed};

}  // namespace dynmesh::DYNMESH_KERNELS
