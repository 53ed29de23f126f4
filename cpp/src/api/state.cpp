#include "api/state.hpp"

#include <bit>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/version.hpp>
#include <optional>
#include <type_traits>

#include "api/settings_table.hpp"
#include "api/stream.hpp"
#include "base/checks.hpp"

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
    const auto names = names_of<Value>();
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

/// Calls `visit(value, why)` for each number that must agree between the stream that wrote a state
/// and the one that reads it. `why(found)` says what is wrong if another value was found.
template <class Settings, class Visit>
void for_each_trait(const StateKind& kind, const Stream& stream, const Settings& settings,
                    const Visit& visit) {
  const std::uint64_t real_size = kind.real_size;
  visit(real_size, [&](std::uint64_t found) {
    return joined("has ", 8 * found, "-bit positions, but this ", kind.name, " has ", 8 * real_size,
                  "-bit ones");
  });
  const std::uint64_t n_vertices = stream.topology.cells.size();
  visit(n_vertices, [&](std::uint64_t found) {
    return joined("belongs to a mesh of ", found, " vertices, but this mesh has ", n_vertices);
  });
  visit(hash_of(std::as_bytes(std::span(stream.faces))), [](std::uint64_t) {
    return "of a mesh with other faces, or with the same in another order or turned over";
  });
  visit(stream.training_hash, [&](std::uint64_t found) {
    const auto which =
        stream.training_hash == 0 ? " with training" : " with another training sequence";
    return joined("of a ", kind.name, found == 0 ? " without training" : which);
  });
  for_each_setting<Settings>([&]<class Value>(const Setting& setting, Value Settings::*member,
                                              auto...) {
    if (!setting.is_stored) return;
    // Not as a number: -0 equals 0, but would not be written again.
    const double value = stored(settings.*member);
    visit(std::bit_cast<std::uint64_t>(value), [&](std::uint64_t found) {
      return joined("of a ", kind.name, " with other settings: ", setting.name, " is ",
                    text_of<Value>(std::bit_cast<double>(found)), ", not ", text_of<Value>(value));
    });
  });
}

}  // namespace

template <class Settings>
void write_head(Writer& writer, const StateKind& kind, const Stream& stream,
                const Settings& settings) {
  writer.write(kind.format);
  for_each_trait(kind, stream, settings, [&](std::uint64_t value, auto) { writer.write(value); });
}

template <class Settings>
Reader read_head(std::span<const std::byte> state, const StateKind& kind, const Stream& stream,
                 const Settings& settings) {
  const std::size_t size = stream.state_size;
  Reader reader(state);
  const auto format = reader.read<StateFormat>();
  if (!std::equal(format.begin(), format.end() - 1, kind.format.begin())) {
    refuse_state(joined("not a ", kind.name, " state"));
  }
  if (format != kind.format) {
    refuse_state(std::string("has format ") + format.back() +
                 ", but dynmesh " DYNMESH_VERSION " reads format " + kind.format.back() +
                 "; create the " + kind.name + " anew");
  }
  for_each_trait(kind, stream, settings, [&](std::uint64_t value, const auto& why) {
    const auto found = reader.read<std::uint64_t>();
    if (found != value) refuse_state(why(found));
  });
  const std::string bytes = joined(state.size(), " bytes");
  if (state.size() < size) refuse_state("truncated: its " + bytes + " are too few");
  if (state.size() > size) refuse_state(joined(state.size() - size, " bytes too long"));
  Reader seal(state.last(sizeof(std::uint64_t)));
  if (seal.read<std::uint64_t>() != hash_of(state.first(size - sizeof(std::uint64_t)))) {
    refuse_state("damaged: its " + bytes + " do not match their checksum");
  }
  return reader;
}

template void write_head(Writer&, const StateKind&, const Stream&, const Settings&);
template void write_head(Writer&, const StateKind&, const Stream&, const TrackerSettings&);
template Reader read_head(std::span<const std::byte>, const StateKind&, const Stream&,
                          const Settings&);
template Reader read_head(std::span<const std::byte>, const StateKind&, const Stream&,
                          const TrackerSettings&);

}  // namespace dynmesh
