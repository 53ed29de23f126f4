/// The stored form of a completer: a header that says what it fits, then the arrays, all
/// little-endian and packed.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <dynmesh/completer.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "completer/exchange.hpp"
#include "mesh/numbering.hpp"
#include "support/geometry.hpp"
#include "support/workers.hpp"

namespace dynmesh {
namespace {

static_assert(std::endian::native == std::endian::little,
              "states are stored as they lie in memory");

constexpr std::array<char, 8> magic = {'d', 'y', 'n', 'm', 'e', 's', 'h', '3'};

[[noreturn]] void refuse(const std::string& why) { throw std::invalid_argument("state: " + why); }

/// What must agree between the completer that wrote a state and the one that reads it.
struct Header {
  std::array<char, 8> magic;
  std::uint32_t real_size;
  std::uint32_t method;
  std::uint32_t revisit;
  std::int32_t extra_iterations;
  std::uint32_t unseen;
  std::uint32_t reject_outliers;
  std::uint64_t n_vertices;
  std::uint64_t cells;  // a hash
  double noise;         // 0 for none
};

/// FNV-1a.
std::uint64_t hash_of(std::span<const std::byte> bytes) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const std::byte byte : bytes) {
    hash = (hash ^ static_cast<std::uint64_t>(byte)) * 1099511628211ULL;
  }
  return hash;
}

static_assert(sizeof(FrameReport) == 80, "stored without padding");

class Writer {
 public:
  template <class T>
  void write(const T* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto* bytes = reinterpret_cast<const std::byte*>(values);
    bytes_.insert(bytes_.end(), bytes, bytes + count * sizeof(T));
  }
  template <class Real>
  void write(const std::vector<Vector3<Real>>& frame) {
    for (const Vector3<Real>& v : frame) write(&v.x, 3);
  }
  /// With a hash of all that was written at the end.
  std::vector<std::byte> take_sealed() {
    const std::uint64_t seal = hash_of(bytes_);
    write(&seal, 1);
    return std::move(bytes_);
  }

 private:
  std::vector<std::byte> bytes_;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : size_(bytes.size()), rest_(bytes) {}

  template <class T>
  void read(T* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (count == 0) return;
    if (rest_.size() < count * sizeof(T)) {
      refuse("cut off: its " + std::to_string(size_) + " bytes are too few");
    }
    std::memcpy(values, rest_.data(), count * sizeof(T));
    rest_ = rest_.subspan(count * sizeof(T));
  }
  template <class Real>
  void read(std::vector<Vector3<Real>>& frame) {
    for (Vector3<Real>& v : frame) read(&v.x, 3);
  }
  [[nodiscard]] std::size_t rest() const { return rest_.size(); }

 private:
  std::size_t size_;
  std::span<const std::byte> rest_;
};

/// States move between meshes of equal connectivity only.
std::uint64_t hash_of(const Cells& cells) {
  return hash_of(std::as_bytes(std::span(cells.offsets))) ^
         hash_of(std::as_bytes(std::span(cells.neighbours))) * 3;
}

template <class Real>
Header header_of(const Settings& settings, const Cells& cells) {
  return {magic,
          sizeof(Real),
          static_cast<std::uint32_t>(settings.method),
          settings.revisit ? 1U : 0U,
          settings.extra_iterations,
          static_cast<std::uint32_t>(settings.unseen),
          settings.reject_outliers ? 1U : 0U,
          cells.size(),
          hash_of(cells),
          settings.noise.value_or(0)};
}

/// The name at such a place, as of an enumeration's value; the bytes may hold any other, too.
std::string name_in(std::span<const char* const> names, std::uint32_t value) {
  return value < names.size() ? names[value] : std::to_string(value);
}

template <class Value>
void check_setting(const char* name, const Value& found, const Value& expected) {
  if (found == expected) return;
  std::ostringstream why;
  why.precision(9);
  why << "of a completer with other settings: " << name << " is " << found << ", not " << expected;
  refuse(why.str());
}

void check_header(const Header& found, const Header& expected) {
  if (found.magic != expected.magic) refuse("not a completer state of this version");
  if (found.real_size != expected.real_size) {
    refuse("of " + std::to_string(8 * found.real_size) + "-bit positions, but this completer has " +
           std::to_string(8 * expected.real_size) + "-bit ones");
  }
  if (found.n_vertices != expected.n_vertices) {
    refuse("of " + std::to_string(found.n_vertices) + " vertices, but this mesh has " +
           std::to_string(expected.n_vertices));
  }
  if (found.cells != expected.cells) refuse("of a mesh with other faces");
  constexpr std::array methods = {"motion", "detail"};
  check_setting("method", name_in(methods, found.method), name_in(methods, expected.method));
  check_setting("revisit", found.revisit, expected.revisit);
  check_setting("extra_iterations", found.extra_iterations, expected.extra_iterations);
  constexpr std::array rules = {"hold", "follow"};
  check_setting("unseen", name_in(rules, found.unseen), name_in(rules, expected.unseen));
  check_setting("reject_outliers", found.reject_outliers, expected.reject_outliers);
  check_setting("noise", found.noise, expected.noise);
}

/// The seal tells what was damaged, not what was made up. Nothing that later frames could not bear
/// gets in here, wherever the bytes are from.
template <class Real>
void check_frame(const std::vector<Vector3<Real>>& frame) {
  const auto wrong = std::ranges::find_if_not(frame, is_in_range<Real>);
  if (wrong == frame.end()) return;
  refuse("holds a position of vertex " + std::to_string(wrong - frame.begin()) +
         " that is not finite, or too large");
}

void check_frame_counts(const FrameReport& report, std::size_t n_vertices) {
  for (const std::size_t count : {report.known, report.filled, report.unseen}) {
    if (count > n_vertices) refuse("reports on " + std::to_string(count) + " vertices");
  }
  if (report.known + report.filled + report.unseen == n_vertices) return;
  refuse("reports on another number of vertices");
}

void check_ages(std::span<const Index> age, std::span<const std::uint8_t> known) {
  for (std::size_t v = 0; v < age.size(); ++v) {
    if (age[v] < 0 || known[v] > 1) {
      refuse("says of vertex " + std::to_string(v) + " that its age is " + std::to_string(age[v]) +
             " and its mask " + std::to_string(known[v]));
    }
  }
}

}  // namespace

template <class Real>
std::vector<std::byte> Completer<Real>::state() const {
  std::vector<std::uint8_t> known(n_vertices());
  std::ranges::transform(generation(), known.begin(), [](Index g) {
    return static_cast<std::uint8_t>(g == Generations::anchor);
  });
  const Header header = header_of<Real>(settings_, topology_->cells);
  Writer writer;
  writer.write(&header, 1);
  writer.write(&report_, 1);
  writer.write(to_vertices(*numbering_, first_frame_));
  writer.write(to_vertices(*numbering_, previous_));
  writer.write(age().data(), n_vertices());
  writer.write(known.data(), n_vertices());
  const auto memory = estimator_->memory();
  const auto memory_rows = static_cast<std::uint64_t>(memory.rows.size());
  writer.write(&memory_rows, 1);
  if (memory_rows > 0) writer.write(to_vertices(*numbering_, memory.rows).data(), n_vertices());
  writer.write(&memory.anchor_weight, 1);
  return writer.take_sealed();
}

template <class Real>
void Completer<Real>::restore(std::span<const std::byte> state) {
  Reader reader(state);
  Header header{};
  reader.read(&header, 1);
  check_header(header, header_of<Real>(settings_, topology_->cells));
  FrameReport report;
  std::vector<Vector3<Real>> first_frame(n_vertices());
  std::vector<Vector3<Real>> previous(n_vertices());
  std::vector<Index> age(n_vertices());
  std::vector<std::uint8_t> known(n_vertices());
  reader.read(&report, 1);
  reader.read(first_frame);
  reader.read(previous);
  reader.read(age.data(), n_vertices());
  reader.read(known.data(), n_vertices());
  std::uint64_t memory_rows = 0;
  reader.read(&memory_rows, 1);
  typename Estimator<Real>::Memory memory;
  memory.rows.resize(memory_rows > 0 ? n_vertices() : 0);
  reader.read(memory.rows.data(), memory.rows.size());
  reader.read(&memory.anchor_weight, 1);
  std::uint64_t seal = 0;
  reader.read(&seal, 1);
  if (reader.rest() != 0) refuse(std::to_string(reader.rest()) + " bytes too long");
  if (seal != hash_of(state.first(state.size() - sizeof seal))) {
    refuse("damaged: its " + std::to_string(state.size()) + " bytes do not fit their checksum");
  }
  check_frame(first_frame);
  check_frame(previous);
  check_frame_counts(report, n_vertices());
  check_ages(age, known);
  const bool has_every_row = memory_rows == memory.rows.size();
  if (!has_every_row || !estimator_->accepts(memory)) refuse("holds no memory of this method");

  begin(to_places(*numbering_, first_frame));
  previous_ = to_places(*numbering_, previous);
  age_ = to_places(*numbering_, age);
  generations_.classify(topology_->cells, to_places(*numbering_, known));
  if (!memory.rows.empty()) {
    memory.rows = to_places(*numbering_, memory.rows);
    estimator_->recall(memory, previous_);
  }
  report_ = report;
}

// The members that stand here; all others are made in completer.cpp.
template std::vector<std::byte> Completer<float>::state() const;
template std::vector<std::byte> Completer<double>::state() const;
template void Completer<float>::restore(std::span<const std::byte>);
template void Completer<double>::restore(std::span<const std::byte>);

}  // namespace dynmesh
