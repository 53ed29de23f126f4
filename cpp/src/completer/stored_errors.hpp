/// Stores what standard errors depend on in a state.
#pragma once

#include <cstddef>
#include <span>

#include "completer/stored_numbers.hpp"
#include "generations/estimator.hpp"
#include "mesh/numbering.hpp"

namespace dynmesh {

/// The numbers that standard errors depend on, one array after another.
inline std::size_t stored_size_of_errors(std::size_t n_vertices) {
  const MemoryOfErrors of_mesh;
  return n_vertices * sizeof(MemoryOfErrors::Row) + sizeof of_mesh.sums;
}

inline void write_errors(Writer& writer, const Numbering& numbering, const MemoryOfErrors& memory) {
  for (const auto& row : to_caller_order(numbering, memory.rows)) {
    writer.write(std::span<const double>(row));
  }
  writer.write(std::span<const double>(memory.sums));
}

inline MemoryOfErrors read_errors(Reader& reader, std::size_t n_vertices) {
  MemoryOfErrors memory;
  memory.rows.resize(n_vertices);
  for (auto& row : memory.rows) reader.read(std::span<double>(row));
  reader.read(std::span<double>(memory.sums));
  return memory;
}

}  // namespace dynmesh
