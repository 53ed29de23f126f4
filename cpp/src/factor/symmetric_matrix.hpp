/// Sparse symmetric matrices.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <vector>

namespace dynmesh {

/// A sparse symmetric matrix. Both triangles are stored, with ascending rows in each column.
struct SymmetricMatrix {
  std::vector<Index> offsets;
  std::vector<Index> rows;
  std::vector<double> values;

  [[nodiscard]] std::size_t size() const { return offsets.size() - 1; }
};

}  // namespace dynmesh
