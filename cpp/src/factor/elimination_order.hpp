/// In which order the columns of a sparse symmetric matrix are eliminated, which decides how many
/// entries its factor has.
#pragma once

#include <dynmesh/types.hpp>
#include <vector>

#include "factor/symmetric_matrix.hpp"

namespace dynmesh {

enum class Ordering {
  minimum_degree,     ///< approximate minimum degree (Amestoy, Davis and Duff 1996), by Eigen
  nested_dissection,  ///< nested dissection (George 1973), by METIS (Karypis and Kumar 1998)
};

/// Whether this build has METIS.
bool has_nested_dissection();

/// The order that `plan_elimination` takes for a matrix of `size` columns: nested dissection for
/// large ones, if this build has it.
Ordering best_ordering(std::size_t size);

/// Returns the column at each position. It depends only on where the matrix has entries. Nested
/// dissection in a build without METIS is minimum degree.
std::vector<Index> elimination_order(const SymmetricMatrix& matrix, Ordering ordering);

}  // namespace dynmesh
