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

/// What must agree between the stream that wrote a state and the one that reads it, beside the
/// settings.
struct Header {
  std::uint32_t real_size = 0;
  std::uint64_t n_vertices = 0;
  std::uint64_t cells = 0;     // a hash
  std::uint64_t training = 0;  // a hash of its frames, 0 without one

  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
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

template <class Settings>
void write_settings(Writer& writer, const Settings& settings) {
  for_each_setting<Settings>([&](const Setting& setting, auto member, auto...) {
    if (setting.is_stored) writer.write(stored(settings.*member));
  });
}

template <class Settings>
std::size_t size_of_settings() {
  std::size_t size = 0;
  for_each_setting<Settings>([&](const Setting& setting, auto /*member*/, auto...) {
    if (setting.is_stored) size += sizeof(double);
  });
  return size;
}

template <class Settings>
void check_stored_settings(Reader& reader, const StateKind& kind, const Settings& settings) {
  for_each_setting<Settings>(
      [&]<class Value>(const Setting& setting, Value Settings::*member, auto...) {
        if (!setting.is_stored) return;
        const auto found = reader.read<double>();
        const double expected = stored(settings.*member);
        // Not as numbers: -0 equals 0, but would not be written again.
        if (std::bit_cast<std::uint64_t>(found) == std::bit_cast<std::uint64_t>(expected)) return;
        refuse_state(std::string("of a ") + kind.name + " with other settings: " + setting.name +
                     " is " + text_of<Value>(found) + ", not " + text_of<Value>(expected));
      });
}

/// A state can be restored only for a mesh of the same connectivity.
std::uint64_t hash_of_cells(const Cells& cells) {
  return hash_of(std::as_bytes(std::span(cells.offsets))) ^
         hash_of(std::as_bytes(std::span(cells.neighbours))) * 3;
}

template <class Real>
Header header_of(const Stream<Real>& stream, std::uint64_t training) {
  const Cells& cells = stream.topology->cells;
  return {sizeof(Real), cells.size(), hash_of_cells(cells), training};
}

void check_header(const Header& found, const Header& expected, const StateKind& kind) {
  const std::string name = kind.name;
  if (found.real_size != expected.real_size) {
    refuse_state("has " + std::to_string(8 * found.real_size) + "-bit positions, but this " + name +
                 " has " + std::to_string(8 * expected.real_size) + "-bit ones");
  }
  if (found.n_vertices != expected.n_vertices) {
    refuse_state("belongs to a mesh of " + std::to_string(found.n_vertices) +
                 " vertices, but this mesh has " + std::to_string(expected.n_vertices));
  }
  if (found.cells != expected.cells) refuse_state("of a mesh with other faces");
  if (found.training != expected.training) {
    refuse_state("of a " + name +
                 (found.training == 0      ? " without training"
                  : expected.training == 0 ? " with training"
                                           : " with another training sequence"));
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

void check_report(const FrameReport& report, std::span<const std::uint8_t> known) {
  if (report.iterations > static_cast<std::size_t>(std::numeric_limits<Index>::max())) {
    refuse_state("reports " + std::to_string(report.iterations) + " iterations");
  }
  const auto n_unknown = static_cast<std::size_t>(std::ranges::count(known, 0));
  if (report.rejected > n_unknown) {
    refuse_state("reports " + std::to_string(report.rejected) + " outliers, but only " +
                 std::to_string(n_unknown) + " vertices were unknown");
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
  return sizeof(StateFormat) + stored_size(Header()) + size_of_settings<Settings>() + of_mesh +
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
  write_fields(writer, header_of(stream, training));
  write_settings(writer, settings);
  write_fields(writer, stored);
}

template <class Real, class Settings>
StoredStream<Real> read_stream(Reader& reader, std::span<const std::byte> state, std::size_t size,
                               const StateKind& kind, const Stream<Real>& stream,
                               const Settings& settings, std::uint64_t training) {
  StateFormat format{};
  reader.read(std::span<char>(format));
  check_format(format, kind.format, kind.name);
  Header header;
  read_fields(reader, header);
  check_header(header, header_of(stream, training), kind);
  check_stored_settings(reader, kind, settings);
  check_seal(state, size);
  StoredStream<Real> stored(stream.n_vertices());
  read_fields(reader, stored);
  check_frame(stored.first_frame);
  check_frame(stored.previous);
  check_ages(stored.age, stored.known, stored.n_frames);
  check_report(stored.report, stored.known);
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
