#include "stream/state.hpp"

#include <algorithm>
#include <bit>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>

#include "stream/settings_table.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

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

/// A state can be restored only for a mesh of the same connectivity.
std::uint64_t hash_of_cells(const Cells& cells) {
  return hash_of(std::as_bytes(std::span(cells.offsets))) ^
         hash_of(std::as_bytes(std::span(cells.neighbours))) * 3;
}

/// Calls `visit(value, why)` for all that must agree between the stream that wrote a state and the
/// one that reads it. `why(found)` is what is wrong if another value was found.
template <class Real, class Settings, class Visit>
void for_each_trait(const StateKind& kind, const Stream<Real>& stream, const Settings& settings,
                    std::uint64_t training, const Visit& visit) {
  const std::string name = kind.name;
  const auto in_bits = [](std::uint64_t size) { return std::to_string(8 * size) + "-bit"; };
  const std::uint64_t n_vertices = stream.n_vertices();
  visit(sizeof(Real), [&](std::uint64_t found) {
    return "has " + in_bits(found) + " positions, but this " + name + " has " +
           in_bits(sizeof(Real)) + " ones";
  });
  visit(n_vertices, [&](std::uint64_t found) {
    return "belongs to a mesh of " + std::to_string(found) + " vertices, but this mesh has " +
           std::to_string(n_vertices);
  });
  visit(hash_of_cells(stream.topology->cells),
        [](std::uint64_t) { return std::string("of a mesh with other faces"); });
  visit(training, [&](std::uint64_t found) {
    return "of a " + name +
           (found == 0      ? " without training"
            : training == 0 ? " with training"
                            : " with another training sequence");
  });
  for_each_setting<Settings>(
      [&]<class Value>(const Setting& setting, Value Settings::*member, auto...) {
        if (!setting.is_stored) return;
        // Not as a number: -0 equals 0, but would not be written again.
        const double value = stored(settings.*member);
        visit(std::bit_cast<std::uint64_t>(value), [&](std::uint64_t found) {
          return "of a " + name + " with other settings: " + setting.name + " is " +
                 text_of<Value>(std::bit_cast<double>(found)) + ", not " + text_of<Value>(value);
        });
      });
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

void check_vertices(std::span<const Index> age, std::span<const std::uint8_t> known) {
  for (std::size_t v = 0; v < age.size(); ++v) {
    if (age[v] >= 0 && known[v] <= 1) continue;
    refuse_state("vertex " + std::to_string(v) + " has the age " + std::to_string(age[v]) +
                 " and the mask " + std::to_string(known[v]) + ", which is not possible");
  }
}

/// Refuses a state that is not of this size, or damaged.
void check_seal(std::span<const std::byte> state, std::size_t size) {
  const std::string bytes = std::to_string(state.size()) + " bytes";
  if (state.size() < size) refuse_state("truncated: its " + bytes + " are too few");
  if (state.size() > size) {
    refuse_state(std::to_string(state.size() - size) + " bytes too long");
  }
  Reader seal(state.last(sizeof(std::uint64_t)));
  if (seal.read<std::uint64_t>() != hash_of(state.first(size - sizeof(std::uint64_t)))) {
    refuse_state("damaged: its " + bytes + " do not match their checksum");
  }
}

}  // namespace

template <class Settings, class Real>
std::size_t size_of_state(const Stream<Real>& stream, std::size_t of_memory) {
  const std::size_t of_mesh = stored_size(StoredStream<Real>(0));
  const std::size_t of_vertex = stored_size(StoredStream<Real>(1)) - of_mesh;
  std::size_t n_traits = 4;
  for_each_setting<Settings>(
      [&](const Setting& setting, auto...) { n_traits += setting.is_stored ? 1 : 0; });
  return sizeof(StateFormat) + n_traits * sizeof(std::uint64_t) + of_mesh +
         stream.n_vertices() * of_vertex + of_memory + sizeof(std::uint64_t);
}

template <class Real, class Settings>
void write_stream(Writer& writer, const StateKind& kind, const Stream<Real>& stream,
                  const Settings& settings, std::uint64_t training, const FrameReport& report) {
  StoredStream<Real> stored(0);
  stored.report = report;
  stored.n_frames = stream.n_frames;
  stored.first_frame = to_caller_order(stream.numbering, stream.first_frame);
  stored.previous = to_caller_order(stream.numbering, stream.previous);
  const auto age = stream.age_of_caller();
  stored.age.assign(age.begin(), age.end());
  const auto known = stream.known_of_caller();
  stored.known.assign(known.begin(), known.end());
  writer.write(std::span<const char>(kind.format));
  for_each_trait(kind, stream, settings, training,
                 [&](std::uint64_t value, const auto&) { writer.write(value); });
  write_fields(writer, stored);
}

template <class Real, class Settings>
StoredStream<Real> read_stream(Reader& reader, std::span<const std::byte> state, std::size_t size,
                               const StateKind& kind, const Stream<Real>& stream,
                               const Settings& settings, std::uint64_t training) {
  StateFormat format{};
  reader.read(std::span<char>(format));
  check_format(format, kind.format, kind.name);
  for_each_trait(kind, stream, settings, training, [&](std::uint64_t value, const auto& why) {
    const auto found = reader.read<std::uint64_t>();
    if (found != value) refuse_state(why(found));
  });
  check_seal(state, size);
  StoredStream<Real> stored(stream.n_vertices());
  read_fields(reader, stored);
  check_frame(stored.first_frame);
  check_frame(stored.previous);
  check_vertices(stored.age, stored.known);
  stored.previous = to_internal_order(stream.numbering, stored.previous);
  stored.age = to_internal_order(stream.numbering, stored.age);
  stored.known = to_internal_order(stream.numbering, stored.known);
  return stored;
}

#define DYNMESH_INSTANTIATE(Real, Settings)                                                       \
  template std::size_t size_of_state<Settings, Real>(const Stream<Real>&, std::size_t);           \
  template void write_stream(Writer&, const StateKind&, const Stream<Real>&, const Settings&,     \
                             std::uint64_t, const FrameReport&);                                  \
  template StoredStream<Real> read_stream(Reader&, std::span<const std::byte>, std::size_t,       \
                                          const StateKind&, const Stream<Real>&, const Settings&, \
                                          std::uint64_t);
DYNMESH_INSTANTIATE(float, Settings)
DYNMESH_INSTANTIATE(double, Settings)
DYNMESH_INSTANTIATE(float, TrackerSettings)
DYNMESH_INSTANTIATE(double, TrackerSettings)
#undef DYNMESH_INSTANTIATE

}  // namespace dynmesh
