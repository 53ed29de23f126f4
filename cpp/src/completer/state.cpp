/// The state of a completer: the properties that another completer must share to restore it,
/// details of the last frame, the arrays, and a checksum. All fields are little-endian and packed.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <limits>
#include <sstream>
#include <string>
#include <utility>

#include "completer/parts.hpp"
#include "completer/stored_numbers.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// The last character is the version of the format.
constexpr std::array<char, 8> magic = {'d', 'y', 'n', 'm', 'e', 's', 'h', '4'};

/// What must agree between the completer that wrote a state and the one that reads it.
struct Header {
  std::uint32_t real_size = 0;
  std::uint32_t method = 0;
  std::uint32_t revisit = 0;
  std::int32_t extra_iterations = 0;
  std::uint32_t unseen = 0;
  std::uint32_t reject_outliers = 0;
  std::uint64_t n_vertices = 0;
  std::uint64_t cells = 0;  // a hash
  double noise = 0;         // 0 for none

  /// Calls `visit` with each field, in the order in which they are stored.
  template <class Self, class Visit>
  static void for_each_field(Self& self, const Visit& visit) {
    visit(self.real_size);
    visit(self.method);
    visit(self.revisit);
    visit(self.extra_iterations);
    visit(self.unseen);
    visit(self.reject_outliers);
    visit(self.n_vertices);
    visit(self.cells);
    visit(self.noise);
  }
};

/// The details of the last frame that cannot be computed from its mask and the mesh.
struct FrameFacts {
  std::int64_t iterations = 0;
  std::uint64_t rejected = 0;
  double blend = 0;

  template <class Self, class Visit>
  static void for_each_field(Self& self, const Visit& visit) {
    visit(self.iterations);
    visit(self.rejected);
    visit(self.blend);
  }
};

template <class Fields>
void write_fields(Writer& writer, const Fields& fields) {
  Fields::for_each_field(fields, [&](auto field) { writer.write(field); });
}

template <class Fields>
Fields read_fields(Reader& reader) {
  Fields fields;
  Fields::for_each_field(fields, [&]<class T>(T& field) { field = reader.read<T>(); });
  return fields;
}

template <class Fields>
std::size_t stored_size() {
  std::size_t size = 0;
  const Fields fields;
  Fields::for_each_field(fields, [&](auto field) { size += sizeof field; });
  return size;
}

/// A state can be restored only for a mesh of the same connectivity.
std::uint64_t hash_of_cells(const Cells& cells) {
  return hash_of(std::as_bytes(std::span(cells.offsets))) ^
         hash_of(std::as_bytes(std::span(cells.neighbours))) * 3;
}

template <class Real>
Header header_of(const Settings& settings, const Cells& cells) {
  return {sizeof(Real),
          static_cast<std::uint32_t>(settings.method),
          settings.revisit ? 1U : 0U,
          settings.extra_iterations,
          static_cast<std::uint32_t>(settings.unseen),
          settings.reject_outliers ? 1U : 0U,
          cells.size(),
          hash_of_cells(cells),
          settings.noise.value_or(0)};
}

/// Returns the name of the value of an enumeration, or the number if it is not a valid one, since
/// the bytes may be arbitrary.
std::string name_in(std::span<const char* const> names, std::uint32_t value) {
  return value < names.size() ? names[value] : std::to_string(value);
}

template <class Value>
void check_setting(const char* name, const Value& found, const Value& expected) {
  if (found == expected) return;
  std::ostringstream why;
  why.precision(9);
  why << "of a completer with other settings: " << name << " is " << found << ", not " << expected;
  refuse_state(why.str());
}

void check_header(const Header& found, const Header& expected) {
  if (found.real_size != expected.real_size) {
    refuse_state("has " + std::to_string(8 * found.real_size) +
                 "-bit positions, but this completer has " +
                 std::to_string(8 * expected.real_size) + "-bit ones");
  }
  if (found.n_vertices != expected.n_vertices) {
    refuse_state("belongs to a mesh of " + std::to_string(found.n_vertices) +
                 " vertices, but this mesh has " + std::to_string(expected.n_vertices));
  }
  if (found.cells != expected.cells) refuse_state("of a mesh with other faces");
  constexpr std::array methods = {"motion", "detail"};
  check_setting("method", name_in(methods, found.method), name_in(methods, expected.method));
  check_setting("revisit", found.revisit, expected.revisit);
  check_setting("extra_iterations", found.extra_iterations, expected.extra_iterations);
  constexpr std::array rules = {"hold", "follow"};
  check_setting("unseen", name_in(rules, found.unseen), name_in(rules, expected.unseen));
  check_setting("reject_outliers", found.reject_outliers, expected.reject_outliers);
  check_setting("noise", found.noise, expected.noise);
}

/// The checksum detects damage but not bytes that were made up. The following checks refuse all
/// values that later frames cannot handle, wherever the bytes come from.
template <class Real>
void check_frame(const std::vector<Vector3<Real>>& frame) {
  const auto wrong = std::ranges::find_if_not(frame, is_in_range<Real>);
  if (wrong == frame.end()) return;
  refuse_state("holds a position of vertex " + std::to_string(wrong - frame.begin()) +
               " that is not finite, or too large");
}

void check_facts(const FrameFacts& facts, std::span<const std::uint8_t> known) {
  if (facts.iterations < 0 || facts.iterations > std::numeric_limits<Index>::max()) {
    refuse_state("reports " + std::to_string(facts.iterations) + " iterations");
  }
  const auto n_unknown = static_cast<std::uint64_t>(std::ranges::count(known, 0));
  if (facts.rejected > n_unknown) {
    refuse_state("reports " + std::to_string(facts.rejected) + " outliers, but only " +
                 std::to_string(n_unknown) + " vertices were unknown");
  }
  if (!std::isfinite(facts.blend)) refuse_state("reports a blend that is not finite");
}

void check_ages(std::span<const Index> age, std::span<const std::uint8_t> known) {
  for (std::size_t v = 0; v < age.size(); ++v) {
    if (age[v] < 0 || known[v] > 1) {
      refuse_state("vertex " + std::to_string(v) + " has the age " + std::to_string(age[v]) +
                   " and the mask " + std::to_string(known[v]) + ", which is not possible");
    }
  }
}

}  // namespace

template <class Real>
std::size_t Completer<Real>::state_size() const {
  using Row = typename Estimator<Real>::Row;
  const std::size_t of_vertex = 2 * 3 * sizeof(Real) + sizeof(Index) + sizeof(std::uint8_t);
  const std::size_t of_method =
      sizeof(std::uint64_t) + parts_->estimator->memory_rows() * sizeof(Row) + sizeof(double);
  const std::size_t of_seal = sizeof(std::uint64_t);
  return sizeof magic + stored_size<Header>() + stored_size<FrameFacts>() +
         n_vertices() * of_vertex + of_method + of_seal;
}

template <class Real>
std::vector<std::byte> Completer<Real>::state() const {
  std::vector<std::uint8_t> known(n_vertices());
  std::ranges::transform(generation(), known.begin(), [](Index g) {
    return static_cast<std::uint8_t>(g == Generations::anchor);
  });
  const FrameFacts facts = {static_cast<std::int64_t>(parts_->report.iterations),
                            parts_->report.rejected, parts_->report.stages.blend};
  Writer writer(state_size());
  writer.write(std::span<const char>(magic));
  write_fields(writer, header_of<Real>(parts_->settings, parts_->topology->cells));
  write_fields(writer, facts);
  writer.write(to_caller_order(parts_->numbering, parts_->first_frame));
  writer.write(to_caller_order(parts_->numbering, parts_->previous));
  writer.write(age());
  writer.write(std::span<const std::uint8_t>(known));
  const auto memory = parts_->estimator->memory();
  writer.write(static_cast<std::uint64_t>(memory.rows.size()));
  if (!memory.rows.empty()) {
    for (const auto& row : to_caller_order(parts_->numbering, memory.rows)) {
      writer.write(std::span<const double>(row));
    }
  }
  writer.write(memory.anchor_weight);
  return writer.take_sealed();
}

template <class Real>
void Completer<Real>::restore(std::span<const std::byte> state) {
  Reader reader(state);
  std::array<char, magic.size()> found_magic{};
  reader.read(std::span<char>(found_magic));
  if (found_magic != magic) refuse_state("not a completer state of this version");
  check_header(read_fields<Header>(reader),
               header_of<Real>(parts_->settings, parts_->topology->cells));
  const auto facts = read_fields<FrameFacts>(reader);
  std::vector<Vector3<Real>> first_frame(n_vertices());
  std::vector<Vector3<Real>> previous(n_vertices());
  std::vector<Index> age(n_vertices());
  std::vector<std::uint8_t> known(n_vertices());
  reader.read(first_frame);
  reader.read(previous);
  reader.read(std::span<Index>(age));
  reader.read(std::span<std::uint8_t>(known));
  const auto memory_rows = reader.read<std::uint64_t>();
  typename Estimator<Real>::Memory memory;
  memory.rows.resize(memory_rows > 0 ? n_vertices() : 0);
  for (auto& row : memory.rows) reader.read(std::span<double>(row));
  memory.anchor_weight = reader.read<double>();
  const auto seal = reader.read<std::uint64_t>();
  if (reader.rest() != 0) refuse_state(std::to_string(reader.rest()) + " bytes too long");
  if (seal != hash_of(state.first(state.size() - sizeof seal))) {
    refuse_state("damaged: its " + std::to_string(state.size()) +
                 " bytes do not match their checksum");
  }
  check_frame(first_frame);
  check_frame(previous);
  check_ages(age, known);
  check_facts(facts, known);
  const bool has_every_row = memory_rows == memory.rows.size();
  if (!has_every_row || !parts_->estimator->accepts(memory))
    refuse_state("does not contain a valid memory of this method");

  previous = to_internal_order(parts_->numbering, previous);
  age = to_internal_order(parts_->numbering, age);
  known = to_internal_order(parts_->numbering, known);
  if (!memory.rows.empty()) memory.rows = to_internal_order(parts_->numbering, memory.rows);
  parts_->begin(to_internal_order(parts_->numbering, first_frame));
  // Nothing below can throw.
  parts_->previous = std::move(previous);
  parts_->age = std::move(age);
  parts_->known = std::move(known);
  parts_->generations.classify(parts_->topology->cells, parts_->known);
  if (!memory.rows.empty()) parts_->estimator->recall(memory, parts_->previous);
  parts_->report.known = parts_->generations.anchors();
  parts_->report.filled = parts_->generations.reached();
  parts_->report.unseen = parts_->generations.unseen_vertices();
  parts_->report.iterations = static_cast<std::size_t>(facts.iterations);
  parts_->report.rejected = facts.rejected;
  parts_->report.stages.blend = facts.blend;
}

// Only the members defined in this file; completer.cpp instantiates the others.
template std::size_t Completer<float>::state_size() const;
template std::size_t Completer<double>::state_size() const;
template std::vector<std::byte> Completer<float>::state() const;
template std::vector<std::byte> Completer<double>::state() const;
template void Completer<float>::restore(std::span<const std::byte>);
template void Completer<double>::restore(std::span<const std::byte>);

}  // namespace dynmesh
