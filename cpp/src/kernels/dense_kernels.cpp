#include "kernels/dense_kernels.hpp"

#include "kernels/lanes.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

// A tile fills half of the registers.
constexpr int tile_height = 4;
static_assert(widest_supernode % (2 * lanes) == 0 && stride_of_products % lanes == 0);

/// Multiplies `height` rows of a with `width` vectors of packed columns of b.
template <int height, int width>
[[gnu::always_inline]] inline void multiply_tile(const double* a, Index c, const double* packed,
                                                 double* products, Index stride) {
  Doubles sums[height][width] = {};
  for (Index k = 0; k < c; ++k) {
    Doubles columns[width];
    for (int w = 0; w < width; ++w) columns[w] = load(packed + (width * k + w) * lanes);
    for (int h = 0; h < height; ++h) {
      const double factor = a[h * c + k];
      for (int w = 0; w < width; ++w) sums[h][w] += factor * columns[w];
    }
  }
  for (int h = 0; h < height; ++h) {
    for (int w = 0; w < width; ++w) store(products + h * stride + lanes * w, sums[h][w]);
  }
}

template <int width>
void multiply_columns(const double* a, Index m, const double* b, Index n, Index c, double* products,
                      Index stride, double* packed) {
  constexpr int taken = lanes * width;
  for (Index j = 0; j < taken; ++j) {
    const double* row = b + (j < n ? j : n - 1) * c;
    for (Index k = 0; k < c; ++k) packed[taken * k + j] = row[k];
  }
  Index i = 0;
  const auto multiply_rows = [&]<int height>() {
    for (; i + height <= m; i += height) {
      multiply_tile<height, width>(a + i * c, c, packed, products + i * stride, stride);
    }
  };
  multiply_rows.template operator()<tile_height>();
  multiply_rows.template operator()<1>();
}

void multiply(const double* a, Index m, Index first, const double* b, Index n, Index c,
              double* products, double* work) {
  const Index stride = (n + stride_of_products - 1) / stride_of_products * stride_of_products;
  for (Index j = 0; j < n; j += 2 * lanes) {
    // Rows before `above` of these columns are in the upper triangle, which is not used.
    const Index above = j > first ? j - first : 0;
    if (above >= m) return;
    const auto multiply_wide = j + lanes < n ? multiply_columns<2> : multiply_columns<1>;
    multiply_wide(a + above * c, m - above, b + j * c, n - j, c, products + above * stride + j,
                  stride, work);
  }
}

/// The transpose is `upper` (columns, widest_supernode).
void factor_triangle(double* panel, Index columns, const double* least, double* inverse,
                     double* upper) {
  for (Index i = 0; i < columns; ++i) {
    for (Index j = 0; j < i; ++j) upper[widest_supernode * j + i] = panel[i * columns + j];
    upper[(widest_supernode + 1) * i] = panel[i * columns + i];
  }
  for (Index k = 0; k < columns; ++k) {
    double* row = upper + widest_supernode * k;
    const double pivot = row[k];
    const double scale = pivot > least[k] ? 1 / __builtin_sqrt(pivot) : 0;
    inverse[k] = scale;
    for (Index j = k; j < columns; ++j) row[j] *= scale;
    for (Index i = k + 1; i < columns; ++i) {
      const double factor = row[i];
      double* other = upper + widest_supernode * i;
      for (Index j = i; j < columns; ++j) other[j] -= factor * row[j];
    }
  }
  for (Index i = 0; i < columns; ++i) {
    for (Index j = 0; j <= i; ++j) panel[i * columns + j] = upper[widest_supernode * j + i];
  }
}

/// Solves for `width` vectors of rows below the triangle, with one row in each lane.
template <int width>
[[gnu::always_inline]] inline void factor_rows(double* rows, Index columns, const double* inverse,
                                               const double* upper) {
  Doubles values[widest_supernode][width];
  for (Index k = 0; k < columns; ++k) {
    for (int w = 0; w < width; ++w) {
      for (int i = 0; i < lanes; ++i) values[k][w][i] = rows[(lanes * w + i) * columns + k];
    }
  }
  for (Index k = 0; k < columns; ++k) {
    Doubles x[width];
    for (int w = 0; w < width; ++w) x[w] = values[k][w] *= inverse[k];
    for (Index j = k + 1; j < columns; ++j) {
      const double factor = upper[widest_supernode * k + j];
      for (int w = 0; w < width; ++w) values[j][w] -= factor * x[w];
    }
  }
  for (Index k = 0; k < columns; ++k) {
    for (int w = 0; w < width; ++w) {
      for (int i = 0; i < lanes; ++i) rows[(lanes * w + i) * columns + k] = values[k][w][i];
    }
  }
}

void factor_row(double* row, Index columns, const double* inverse, const double* upper) {
  for (Index k = 0; k < columns; ++k) {
    const double x = row[k] *= inverse[k];
    for (Index j = k + 1; j < columns; ++j) row[j] -= upper[widest_supernode * k + j] * x;
  }
}

void factor_below(double* rows, Index n, Index columns, const double* inverse,
                  const double* upper) {
  Index r = 0;
  for (; r + 2 * lanes <= n; r += 2 * lanes) {
    factor_rows<2>(rows + r * columns, columns, inverse, upper);
  }
  for (; r + lanes <= n; r += lanes) factor_rows<1>(rows + r * columns, columns, inverse, upper);
  for (; r < n; ++r) factor_row(rows + r * columns, columns, inverse, upper);
}

template <class Real, int fields>
void subtract_from(const Real* rows, Index n, Index columns, const Real* own, const Index* targets,
                   Real* values) {
  using Quad = decltype(load(static_cast<const Real*>(nullptr)));
  constexpr int step = 4 * fields;
  const auto subtract = [&]<int height>(Index r) {
    Quad sums[height][fields] = {};
    const Real* l = rows + r * columns;
    for (Index j = 0; j < columns; ++j) {
      for (int f = 0; f < fields; ++f) {
        const Quad x = load(own + j * step + 4 * f);
        for (int h = 0; h < height; ++h) sums[h][f] += l[h * columns + j] * x;
      }
    }
    for (int h = 0; h < height; ++h) {
      Real* y = values + static_cast<std::ptrdiff_t>(targets[r + h]) * step;
      for (int f = 0; f < fields; ++f) store(y + 4 * f, load(y + 4 * f) - sums[h][f]);
    }
  };
  Index r = 0;
  for (; r + 4 <= n; r += 4) subtract.template operator()<4>(r);
  for (; r < n; ++r) subtract.template operator()<1>(r);
}

/// Completes row j of a solution with the triangle, and subtracts its product with l from the rows
/// `first` to `last` - 1, of which row i has the factor l[i * stride].
template <class Real, int fields>
[[gnu::always_inline]] inline void solve_row(Real* own, Index j, Real inverse, const Real* l,
                                             Index stride, Index first, Index last) {
  using Quad = decltype(load(static_cast<const Real*>(nullptr)));
  constexpr int step = 4 * fields;
  Quad x[fields];
  for (int f = 0; f < fields; ++f) {
    x[f] = inverse * load(own + j * step + 4 * f);
    store(own + j * step + 4 * f, x[f]);
  }
  for (Index i = first; i < last; ++i) {
    const Real factor = l[i * stride];
    for (int f = 0; f < fields; ++f) {
      Real* y = own + i * step + 4 * f;
      store(y, load(y) - factor * x[f]);
    }
  }
}

template <class Real, int fields>
void forward(const Real* panel, Index columns, const Real* inverse, Real* own) {
  for (Index j = 0; j < columns; ++j) {
    solve_row<Real, fields>(own, j, inverse[j], panel + j, columns, j + 1, columns);
  }
}

template <class Real, int fields>
void backward(const Real* panel, Index rows, Index columns, const Real* inverse, Real* own,
              const Index* below, const Real* values) {
  using Quad = decltype(load(static_cast<const Real*>(nullptr)));
  constexpr int step = 4 * fields;
  const auto subtract = [&]<int height>(Index r) {
    Quad x[height][fields];
    for (int h = 0; h < height; ++h) {
      const Real* y = values + static_cast<std::ptrdiff_t>(below[r - columns + h]) * step;
      for (int f = 0; f < fields; ++f) x[h][f] = load(y + 4 * f);
    }
    const Real* l = panel + r * columns;
    for (Index j = 0; j < columns; ++j) {
      for (int f = 0; f < fields; ++f) {
        Real* y = own + j * step + 4 * f;
        Quad sum = load(y);
        for (int h = 0; h < height; ++h) sum -= l[h * columns + j] * x[h][f];
        store(y, sum);
      }
    }
  };
  Index r = columns;
  for (; r + 4 <= rows; r += 4) subtract.template operator()<4>(r);
  for (; r < rows; ++r) subtract.template operator()<1>(r);
  for (Index i = columns; i-- > 0;) {
    solve_row<Real, fields>(own, i, inverse[i], panel + i * columns, 1, 0, i);
  }
}

template <class Real, int fields>
constexpr SolveKernels<Real> solve_kernels = {forward<Real, fields>, subtract_from<Real, fields>,
                                              backward<Real, fields>};

}  // namespace

extern const DenseKernels dense_kernels;
const DenseKernels dense_kernels = {multiply,
                                    factor_triangle,
                                    factor_below,
                                    solve_kernels<double, 1>,
                                    solve_kernels<double, 3>,
                                    solve_kernels<float, 1>};

}  // namespace dynmesh::DYNMESH_KERNELS
