#include "stream/state.hpp"

#include <algorithm>
#include <bit>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/version.hpp>
#include <optional>
#include <type_traits>
#include <utility>

#include "stream/settings_table.hpp"
#include "support/checks.hpp"
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
  return to_text(number);
}

/// A state can be restored only for a mesh of the same connectivity.
std::uint64_t hash_of_cells(const Cells& cells) {
  return hash_of(std::as_bytes(std::span(cells.offsets))) ^
         hash_of(std::as_bytes(std::span(cells.neighbours))) * 3;
}

}  // namespace

template <class Settings>
std::vector<Trait> traits_of(const StateKind& kind, std::size_t real_size, const StreamMesh& mesh,
                             const Settings& settings) {
  const char* const name = kind.name;
  const std::uint64_t n_vertices = mesh.topology.cells.size();
  const std::uint64_t training = mesh.training_hash;
  std::vector<Trait> traits;
  const auto add = [&](std::uint64_t value, std::function<std::string(std::uint64_t)> why) {
    traits.push_back({value, std::move(why)});
  };
  add(real_size, [=](std::uint64_t found) {
    return joined("has ", 8 * found, "-bit positions, but this ", name, " has ", 8 * real_size,
                  "-bit ones");
  });
  add(n_vertices, [=](std::uint64_t found) {
    return joined("belongs to a mesh of ", found, " vertices, but this mesh has ", n_vertices);
  });
  add(hash_of_cells(mesh.topology.cells),
      [](std::uint64_t) { return "of a mesh with other faces"; });
  add(training, [=](std::uint64_t found) {
    const auto which = training == 0 ? " with training" : " with another training sequence";
    return joined("of a ", name, found == 0 ? " without training" : which);
  });
  for_each_setting<Settings>([&]<class Value>(const Setting& setting, Value Settings::*member,
                                              auto...) {
    if (!setting.is_stored) return;
    // Not as a number: -0 equals 0, but would not be written again.
    const double value = stored(settings.*member);
    add(std::bit_cast<std::uint64_t>(value), [=](std::uint64_t found) {
      return joined("of a ", name, " with other settings: ", setting.name, " is ",
                    text_of<Value>(std::bit_cast<double>(found)), ", not ", text_of<Value>(value));
    });
  });
  return traits;
}

void begin_state(Writer& writer, const StateKind& kind, const std::vector<Trait>& traits) {
  writer.write(std::span<const char>(kind.format));
  for (const Trait& trait : traits) writer.write(trait.value);
}

Reader open_state(std::span<const std::byte> state, std::size_t size, const StateKind& kind,
                  const std::vector<Trait>& traits) {
  Reader reader(state);
  StateFormat format{};
  reader.read(std::span<char>(format));
  if (!std::equal(format.begin(), format.end() - 1, kind.format.begin())) {
    refuse_state(joined("not a ", kind.name, " state"));
  }
  if (format != kind.format) {
    refuse_state(std::string("has format ") + format.back() +
                 ", but dynmesh " DYNMESH_VERSION " reads format " + kind.format.back() +
                 "; create the " + kind.name + " anew");
  }
  for (const Trait& trait : traits) {
    const auto found = reader.read<std::uint64_t>();
    if (found != trait.value) refuse_state(trait.why(found));
  }
  const std::string bytes = joined(state.size(), " bytes");
  if (state.size() < size) refuse_state("truncated: its " + bytes + " are too few");
  if (state.size() > size) refuse_state(joined(state.size() - size, " bytes too long"));
  Reader seal(state.last(sizeof(std::uint64_t)));
  if (seal.read<std::uint64_t>() != hash_of(state.first(size - sizeof(std::uint64_t)))) {
    refuse_state("damaged: its " + bytes + " do not match their checksum");
  }
  return reader;
}

template <class Real>
std::vector<Vector3<Real>> stored_frame(Reader& reader, std::size_t n_vertices) {
  std::vector<Vector3<Real>> frame(n_vertices);
  reader.read(frame);
  check_stored_frame(frame);
  return frame;
}

template <class Real>
void check_stored_frame(const std::vector<Vector3<Real>>& frame) {
  const auto wrong = std::ranges::find_if_not(frame, is_in_range<Real>);
  if (wrong == frame.end()) return;
  refuse_state("holds a position of vertex " + std::to_string(wrong - frame.begin()) +
               " that is not finite, or too large");
}

template std::vector<Vector3<float>> stored_frame(Reader&, std::size_t);
template std::vector<Vector3<double>> stored_frame(Reader&, std::size_t);
template void check_stored_frame(const std::vector<Vector3<float>>&);
template void check_stored_frame(const std::vector<Vector3<double>>&);
template std::vector<Trait> traits_of(const StateKind&, std::size_t, const StreamMesh&,
                                      const Settings&);
template std::vector<Trait> traits_of(const StateKind&, std::size_t, const StreamMesh&,
                                      const TrackerSettings&);

}  // namespace dynmesh
