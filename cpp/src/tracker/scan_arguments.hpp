/// Checks and converts the positions of scans and templates.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "stream/arguments.hpp"
#include "support/checks.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

/// More points than 32-bit indices can count are refused.
template <class Real>
void check_scan(const char* argument, const Points<const Real>& rows) {
  if (rows.count > static_cast<std::size_t>(std::numeric_limits<Index>::max())) {
    throw std::invalid_argument(std::string(argument) + ": has " + std::to_string(rows.count) +
                                " rows, more than 32-bit indices can count");
  }
  check_view(argument, rows);
  for (std::size_t i = 0; i < rows.count; ++i) {
    check_position(argument, "row", i, row(rows, i), "all rows must be finite");
  }
}

template <class Real>
void copy(const Points<const Real>& rows, std::vector<Vector3<double>>& copies) {
  copies.resize(rows.count);
  for (std::size_t i = 0; i < rows.count; ++i) copies[i] = in_double(row(rows, i));
}

}  // namespace dynmesh
