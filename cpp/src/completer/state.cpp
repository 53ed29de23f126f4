/// The state of a completer: the properties that another completer must share to restore it,
/// details of the last frame, the arrays, and a checksum. All fields are little-endian and packed.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>

#include "completer/parts.hpp"
#include "completer/settings_table.hpp"
#include "completer/stored_errors.hpp"
#include "completer/stored_numbers.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// The last character is the version of the format.
constexpr StateFormat format = {'d', 'y', 'n', 'm', 'e', 's', 'h', '8'};

/// What must agree between the completer that wrote a state and the one that reads it, beside the
/// settings.
struct Header {
  std::uint32_t real_size = 0;
  std::uint64_t n_vertices = 0;
  std::uint64_t cells = 0;     // a hash
  std::uint64_t training = 0;  // a hash of its frames, 0 without one

  /// Calls `visit` with each field, in the order in which they are stored.
  template <class Self, class Visit>
  static void for_each_field(Self& self, const Visit& visit) {
    visit(self.real_size);
    visit(self.n_vertices);
    visit(self.cells);
    visit(self.training);
  }
};

/// Settings are stored as a number each.
template <class Value>
double stored(const Value& value) {
  if constexpr (std::is_same_v<Value, std::optional<double>>) {
    return value.value_or(0);  // which no noise can be
  } else {
    return static_cast<double>(value);
  }
}

/// A stored value as it is written in Python. The bytes may hold any number.
template <class Value>
std::string text_of(double number) {
  std::ostringstream text;
  text.precision(9);
  if constexpr (std::is_enum_v<Value>) {
    const auto& names = names_of<Value>;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (number == static_cast<double>(i)) return std::string(names[i]);
    }
  } else if constexpr (std::is_same_v<Value, bool>) {
    if (number == 0 || number == 1) return number == 1 ? "True" : "False";
  } else if constexpr (std::is_same_v<Value, std::optional<double>>) {
    if (number == 0) return "None";
  }
  text << number;
  return text.str();
}

void write_settings(Writer& writer, const Settings& settings) {
  for_each_setting([&](const Setting& setting, auto member) {
    if (setting.is_stored) writer.write(stored(settings.*member));
  });
}

std::size_t size_of_settings() {
  std::size_t size = 0;
  for_each_setting([&](const Setting& setting, auto /*member*/) {
    if (setting.is_stored) size += sizeof(double);
  });
  return size;
}

void check_settings_of_state(Reader& reader, const Settings& settings) {
  for_each_setting([&]<class Value>(const Setting& setting, Value Settings::*member) {
    if (!setting.is_stored) return;
    const auto found = reader.read<double>();
    const double expected = stored(settings.*member);
    // Not as numbers: -0 equals 0, but would not be written again.
    if (std::bit_cast<std::uint64_t>(found) == std::bit_cast<std::uint64_t>(expected)) return;
    refuse_state(std::string("of a completer with other settings: ") + setting.name + " is " +
                 text_of<Value>(found) + ", not " + text_of<Value>(expected));
  });
}

/// The details of the last frame that cannot be computed from its mask and the mesh.
struct FrameFacts {
  std::int64_t iterations = 0;
  std::uint64_t rejected = 0;
  double blend = 0;
  double prior_weight = 0;
  double prior_share = 0;
  std::uint64_t n_frames = 0;

  template <class Self, class Visit>
  static void for_each_field(Self& self, const Visit& visit) {
    visit(self.iterations);
    visit(self.rejected);
    visit(self.blend);
    visit(self.prior_weight);
    visit(self.prior_share);
    visit(self.n_frames);
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
Header header_of(const Cells& cells, std::uint64_t training) {
  return {sizeof(Real), cells.size(), hash_of_cells(cells), training};
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
  if (found.training != expected.training) {
    refuse_state(found.training == 0      ? "of a completer without training"
                 : expected.training == 0 ? "of a completer with training"
                                          : "of a completer with another training sequence");
  }
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
  for (const double share : {facts.prior_weight, facts.prior_share}) {
    if (!(share >= 0 && share <= 1)) refuse_state("reports a share that is not between 0 and 1");
  }
}

void check_ages(std::span<const Index> age, std::span<const std::uint8_t> known,
                std::uint64_t n_frames) {
  for (std::size_t v = 0; v < age.size(); ++v) {
    if (age[v] > 0 && static_cast<std::uint64_t>(age[v]) > n_frames) {
      refuse_state("vertex " + std::to_string(v) + " has the age " + std::to_string(age[v]) +
                   " after " + std::to_string(n_frames) + " frames, which is not possible");
    }
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
  using Shapes = typename Estimator<Real>::Shapes;
  const std::size_t of_vertex = 2 * 3 * sizeof(Real) + sizeof(Index) + sizeof(std::uint8_t);
  const std::size_t of_method = sizeof(std::uint64_t) +
                                parts_->estimator->memory_rows() * sizeof(Row) + sizeof(double) +
                                parts_->estimator->shape_fit_size() * sizeof(double) +
                                parts_->estimator->shape_rows() * sizeof(Shapes);
  const std::size_t of_errors =
      parts_->settings.uncertainty ? stored_size_of_errors(n_vertices()) : 0;
  const std::size_t of_seal = sizeof(std::uint64_t);
  return sizeof format + stored_size<Header>() + size_of_settings() + stored_size<FrameFacts>() +
         n_vertices() * of_vertex + of_method + of_errors + of_seal;
}

template <class Real>
std::vector<std::byte> Completer<Real>::state() const {
  std::vector<std::uint8_t> known(n_vertices());
  std::ranges::transform(generation(), known.begin(), [](Index g) {
    return static_cast<std::uint8_t>(g == Generations::anchor);
  });
  const FrameFacts facts = {static_cast<std::int64_t>(parts_->report.iterations),
                            parts_->report.rejected,
                            parts_->report.stages.blend,
                            parts_->report.stages.prior_weight,
                            parts_->report.stages.prior_share,
                            parts_->n_frames};
  Writer writer(state_size());
  writer.write(std::span<const char>(format));
  write_fields(writer, header_of<Real>(parts_->topology->cells, parts_->training_hash));
  write_settings(writer, parts_->settings);
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
  writer.write(std::span<const double>(memory.pose));
  if (!memory.shapes.empty()) {
    for (const auto& shapes : to_caller_order(parts_->numbering, memory.shapes)) {
      writer.write(std::span<const float>(shapes));
    }
  }
  if (parts_->settings.uncertainty) write_errors(writer, parts_->numbering, memory.errors);
  return writer.take_sealed();
}

template <class Real>
void Completer<Real>::restore(std::span<const std::byte> state) {
  Reader reader(state);
  StateFormat found_format{};
  reader.read(std::span<char>(found_format));
  check_format(found_format, format, "completer");
  check_header(read_fields<Header>(reader),
               header_of<Real>(parts_->topology->cells, parts_->training_hash));
  check_settings_of_state(reader, parts_->settings);
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
  memory.pose.resize(parts_->estimator->shape_fit_size());
  reader.read(std::span<double>(memory.pose));
  memory.shapes.resize(parts_->estimator->shape_rows());
  for (auto& shapes : memory.shapes) reader.read(std::span<float>(shapes));
  if (parts_->settings.uncertainty) memory.errors = read_errors(reader, n_vertices());
  const auto seal = reader.read<std::uint64_t>();
  if (reader.rest() != 0) refuse_state(std::to_string(reader.rest()) + " bytes too long");
  if (seal != hash_of(state.first(state.size() - sizeof seal))) {
    refuse_state("damaged: its " + std::to_string(state.size()) +
                 " bytes do not match their checksum");
  }
  check_frame(first_frame);
  check_frame(previous);
  check_ages(age, known, facts.n_frames);
  check_facts(facts, known);
  const bool has_every_row = memory_rows == memory.rows.size();
  if (!has_every_row || !parts_->estimator->accepts(memory))
    refuse_state("does not contain a valid memory of this method");

  previous = to_internal_order(parts_->numbering, previous);
  age = to_internal_order(parts_->numbering, age);
  known = to_internal_order(parts_->numbering, known);
  if (!memory.rows.empty()) memory.rows = to_internal_order(parts_->numbering, memory.rows);
  if (!memory.shapes.empty()) {
    memory.shapes = to_internal_order(parts_->numbering, memory.shapes);
  }
  if (parts_->settings.uncertainty) {
    memory.errors.rows = to_internal_order(parts_->numbering, memory.errors.rows);
  }
  parts_->begin(to_internal_order(parts_->numbering, first_frame));
  // Nothing below can throw.
  parts_->previous = std::move(previous);
  parts_->age = std::move(age);
  parts_->known = std::move(known);
  parts_->generations.classify(parts_->topology->cells, parts_->known);
  if (!memory.rows.empty()) parts_->estimator->recall(memory, parts_->previous);
  parts_->n_frames = facts.n_frames;
  parts_->report.known = parts_->generations.anchors();
  parts_->report.filled = parts_->generations.reached();
  parts_->report.disconnected = parts_->generations.disconnected_vertices();
  parts_->report.iterations = static_cast<std::size_t>(facts.iterations);
  parts_->report.rejected = facts.rejected;
  parts_->report.stages.blend = facts.blend;
  parts_->report.stages.prior_weight = facts.prior_weight;
  parts_->report.stages.prior_share = facts.prior_share;
  parts_->report.standard_error = parts_->mean_standard_error();
}

// Only the members defined in this file; completer.cpp instantiates the others.
template std::size_t Completer<float>::state_size() const;
template std::size_t Completer<double>::state_size() const;
template std::vector<std::byte> Completer<float>::state() const;
template std::vector<std::byte> Completer<double>::state() const;
template void Completer<float>::restore(std::span<const std::byte>);
template void Completer<double>::restore(std::span<const std::byte>);

}  // namespace dynmesh
