/// What a state keeps of the error bars.
#include <algorithm>
#include <cmath>

#include "detail/error_bars.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// The numbers of frames are stored as double.
constexpr double largest_frame = 9e15;

}  // namespace

std::size_t ErrorBars::memory_size() const {
  return exist() ? standard_errors_.size() * sizeof(Memory::Row) + sizeof Memory{}.sums : 0;
}

void ErrorBars::write_memory(Writer& writer) const {
  if (!exist()) return;
  const auto write = [&](const Vector3<double>& x) {
    for (const double coordinate : {x.x, x.y, x.z}) writer.write(coordinate);
  };
  for (std::size_t v = 0; v < standard_errors_.size(); ++v) {
    for (const Members* of : {&errors_, &changes_}) {
      for (std::size_t i = members * v; i < members * (v + 1); ++i) write((*of)[i]);
    }
    writer.write(sizes_.energy(v).found);
    writer.write(sizes_.energy(v).expected);
    writer.write(standard_errors_[v]);
  }
  for (const double sum : {energy_.found, energy_.expected, static_cast<double>(frame_)}) {
    writer.write(sum);
  }
}

ErrorBars::Memory ErrorBars::read_memory(Reader& reader) const {
  Memory memory;
  if (!exist()) return memory;
  memory.rows.resize(standard_errors_.size());
  for (auto& row : memory.rows) reader.read(std::span<double>(row));
  reader.read(std::span<double>(memory.sums));
  return memory;
}

bool ErrorBars::accepts(const Memory& memory) const {
  if (memory.rows.size() != standard_errors_.size()) return false;
  const auto is_sum = [](double x) { return x >= 0 && std::isfinite(x); };
  const auto is_sound = [&](const Memory::Row& row) {
    const auto end_of_members = row.begin() + 6 * members;
    return std::all_of(row.begin(), end_of_members,
                       [](double x) { return std::abs(x) < largest_member; }) &&
           is_sum(row[18]) && is_sum(row[19]) && row[20] >= 0;
  };
  const auto& [found, expected, frame] = memory.sums;
  return std::ranges::all_of(memory.rows, is_sound) && is_sum(found) && is_sum(expected) &&
         is_sum(frame) && frame == std::floor(frame) && frame < largest_frame &&
         (exist() || memory.sums == Memory{}.sums);
}

void ErrorBars::recall(const Memory& memory) {
  if (!exist()) return;
  for (std::size_t v = 0; v < memory.rows.size(); ++v) {
    auto number = memory.rows[v].begin();
    const auto next = [&] {
      const Vector3<double> x = {number[0], number[1], number[2]};
      number += 3;
      return x;
    };
    for (Members* of : {&errors_, &changes_}) {
      for (std::size_t i = members * v; i < members * (v + 1); ++i) (*of)[i] = next();
    }
    const double found = *number++;
    sizes_.recall(v, {found, *number++});
    standard_errors_[v] = *number++;
  }
  energy_ = {memory.sums[0], memory.sums[1]};
  frame_ = static_cast<std::uint64_t>(memory.sums[2]);
  sizes_.find(workers_);
}

}  // namespace dynmesh
