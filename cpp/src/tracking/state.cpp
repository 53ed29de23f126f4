/// The state of a tracker: what another tracker must share to restore it, details of the last
/// frame, the arrays, and a checksum. All fields are little-endian and packed, and arrays in the
/// caller's order.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <dynmesh/tracker.hpp>
#include <limits>
#include <string>
#include <utility>

#include "completer/stored_errors.hpp"
#include "completer/stored_numbers.hpp"
#include "support/geometry.hpp"
#include "tracking/parts.hpp"

namespace dynmesh {
namespace {

/// The last character is the version of the format.
constexpr StateFormat format = {'d', 'y', 'n', 't', 'r', 'a', 'c', '2'};

using StoredRotation = std::array<double, 4>;

/// All numbers beside the arrays.
struct Facts {
  std::uint32_t real_size = 0;
  std::uint32_t is_first = 0;
  std::uint32_t aligned = 0;
  std::uint32_t iterations = 0;
  std::uint32_t uncertainty = 0;
  std::uint64_t n_vertices = 0;
  std::uint64_t cells = 0;     // a hash
  std::uint64_t training = 0;  // a hash of its frames, 0 without one
  std::uint64_t n_frames = 0;
  double distance = 0;
  double prior_weight = 0;
  double prior_share = 0;

  template <class Self, class Visit>
  static void for_each_field(Self& self, const Visit& visit) {
    visit(self.real_size);
    visit(self.is_first);
    visit(self.aligned);
    visit(self.iterations);
    visit(self.uncertainty);
    visit(self.n_vertices);
    visit(self.cells);
    visit(self.training);
    visit(self.n_frames);
    visit(self.distance);
    visit(self.prior_weight);
    visit(self.prior_share);
  }
};

std::size_t size_of_facts() {
  std::size_t size = 0;
  const Facts facts;
  Facts::for_each_field(facts, [&](auto field) { size += sizeof field; });
  return size;
}

/// A state can be restored only for a mesh of the same connectivity.
std::uint64_t hash_of_connectivity(const Cells& cells) {
  return hash_of(std::as_bytes(std::span(cells.offsets))) ^
         hash_of(std::as_bytes(std::span(cells.neighbours))) * 3;
}

template <class Real>
std::vector<Vector3<Real>> rounded(std::span<const Vector3<double>> frame) {
  std::vector<Vector3<Real>> result(frame.size());
  std::ranges::transform(frame, result.begin(), [](const Vector3<double>& x) {
    return Vector3<Real>{static_cast<Real>(x.x), static_cast<Real>(x.y), static_cast<Real>(x.z)};
  });
  return result;
}

template <class Real>
std::vector<Vector3<double>> widened(const std::vector<Vector3<Real>>& frame) {
  std::vector<Vector3<double>> result(frame.size());
  std::ranges::transform(frame, result.begin(), in_double<Real>);
  return result;
}

template <class Real>
void check_stored_frame(const std::vector<Vector3<Real>>& frame) {
  for (std::size_t v = 0; v < frame.size(); ++v) {
    if (is_in_range(frame[v])) continue;
    refuse_state("holds a position of vertex " + std::to_string(v) +
                 " that is not finite, or too large");
  }
}

void check_facts(const Facts& found, const Facts& expected) {
  if (found.real_size != expected.real_size) {
    refuse_state("has " + std::to_string(8 * std::uint64_t{found.real_size}) +
                 "-bit positions, but this tracker has " + std::to_string(8 * expected.real_size) +
                 "-bit ones");
  }
  if (found.n_vertices != expected.n_vertices) {
    refuse_state("belongs to a mesh of " + std::to_string(found.n_vertices) +
                 " vertices, but this mesh has " + std::to_string(expected.n_vertices));
  }
  if (found.cells != expected.cells) refuse_state("of a mesh with other faces");
  if (found.training != expected.training) {
    refuse_state(found.training == 0      ? "of a tracker without training"
                 : expected.training == 0 ? "of a tracker with training"
                                          : "of a tracker with another training sequence");
  }
  if (found.uncertainty != expected.uncertainty) {
    refuse_state(expected.uncertainty != 0 ? "of a tracker with uncertainty=False, not True"
                                           : "of a tracker with uncertainty=True, not False");
  }
  if (found.is_first > 1 || found.aligned > 1 || !(found.distance >= 0) ||
      !std::isfinite(found.distance)) {
    refuse_state("reports what no tracker can report");
  }
}

}  // namespace

template <class Real>
std::size_t Tracker<Real>::state_size() const {
  const std::size_t of_vertex =
      3 * 3 * sizeof(Real) + sizeof(Index) + sizeof(std::uint8_t) + sizeof(StoredRotation);
  const std::size_t of_pose = parts_->surface.rest().shape_fit_size() * sizeof(double);
  const std::size_t of_errors = settings().uncertainty ? stored_size_of_errors(n_vertices()) : 0;
  return sizeof format + size_of_facts() + n_vertices() * of_vertex + of_pose + of_errors +
         sizeof(std::uint64_t);
}

template <class Real>
std::vector<std::byte> Tracker<Real>::state() const {
  const SurfaceTracking& surface = parts_->surface;
  const RestShape::Memory pose = surface.rest().memory();
  const Facts facts = {sizeof(Real),
                       surface.is_first() ? 1U : 0U,
                       parts_->report.aligned ? 1U : 0U,
                       static_cast<std::uint32_t>(parts_->report.iterations),
                       settings().uncertainty ? 1U : 0U,
                       n_vertices(),
                       hash_of_connectivity(parts_->topology->cells),
                       parts_->training_hash,
                       parts_->n_frames,
                       parts_->report.distance,
                       pose.prior_weight,
                       pose.prior_share};
  Writer writer(state_size());
  writer.write(std::span<const char>(format));
  Facts::for_each_field(facts, [&](auto field) { writer.write(field); });
  for (const auto& frame :
       {parts_->first_frame, rounded<Real>(surface.last()), rounded<Real>(surface.before())}) {
    writer.write(to_caller_order(parts_->numbering, frame));
  }
  writer.write(age());
  writer.write(observed());
  const auto rotations = surface.rotations();
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const Quaternion& q = rotations[parts_->numbering.internal_index(i)];
    const StoredRotation stored = {q.w, q.x, q.y, q.z};
    writer.write(std::span<const double>(stored));
  }
  writer.write(std::span<const double>(pose.pose));
  if (settings().uncertainty) {
    write_errors(writer, parts_->numbering, surface.error_bars().memory());
  }
  return writer.take_sealed();
}

template <class Real>
void Tracker<Real>::restore(std::span<const std::byte> state) {
  Reader reader(state);
  StateFormat found_format{};
  reader.read(std::span<char>(found_format));
  check_format(found_format, format, "tracker");
  Facts facts;
  Facts::for_each_field(facts, [&]<class T>(T& field) { field = reader.read<T>(); });
  Facts expected;
  expected.real_size = sizeof(Real);
  expected.n_vertices = n_vertices();
  expected.cells = hash_of_connectivity(parts_->topology->cells);
  expected.training = parts_->training_hash;
  expected.uncertainty = settings().uncertainty ? 1 : 0;
  check_facts(facts, expected);
  const std::size_t k = n_vertices();
  std::array<std::vector<Vector3<Real>>, 3> frames;
  for (auto& frame : frames) {
    frame.resize(k);
    reader.read(frame);
    check_stored_frame(frame);
    frame = to_internal_order(parts_->numbering, frame);
  }
  std::vector<Index> age(k);
  std::vector<std::uint8_t> known(k);
  std::vector<Quaternion> rotations(k);
  reader.read(std::span<Index>(age));
  reader.read(std::span<std::uint8_t>(known));
  for (std::size_t i = 0; i < k; ++i) {
    StoredRotation q{};
    reader.read(std::span<double>(q));
    rotations[i] = {q[0], q[1], q[2], q[3]};
    const double norm = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    constexpr double rounding = 1e-6;
    const bool is_possible = age[i] >= 0 && static_cast<std::uint64_t>(age[i]) <= facts.n_frames &&
                             known[i] <= 1 && std::abs(norm - 1) <= rounding;
    if (!is_possible)
      refuse_state("vertex " + std::to_string(i) + " has a memory that is not possible");
  }
  RestShape::Memory pose = {facts.prior_weight, facts.prior_share, {}};
  pose.pose.resize(parts_->surface.rest().shape_fit_size());
  reader.read(std::span<double>(pose.pose));
  MemoryOfErrors errors;
  if (settings().uncertainty) errors = read_errors(reader, k);
  const auto seal = reader.read<std::uint64_t>();
  if (reader.rest() != 0) refuse_state(std::to_string(reader.rest()) + " bytes too long");
  if (seal != hash_of(state.first(state.size() - sizeof seal))) {
    refuse_state("damaged: its " + std::to_string(state.size()) +
                 " bytes do not match their checksum");
  }
  if (!parts_->surface.rest().accepts(pose) || !parts_->surface.error_bars().accepts(errors)) {
    refuse_state("does not contain a valid pose and valid errors");
  }
  age = to_internal_order(parts_->numbering, age);
  known = to_internal_order(parts_->numbering, known);
  rotations = to_internal_order(parts_->numbering, rotations);
  const auto last = widened(frames[1]);
  const auto before = widened(frames[2]);
  if (settings().uncertainty) errors.rows = to_internal_order(parts_->numbering, errors.rows);
  parts_->begin(std::move(frames[0]));
  // Nothing below can throw.
  parts_->surface.recall(last, before, rotations, facts.is_first != 0);
  parts_->surface.recall_pose(pose);
  parts_->surface.recall_errors(errors);
  parts_->previous = std::move(frames[1]);
  parts_->age = std::move(age);
  parts_->known = std::move(known);
  parts_->generations.classify(parts_->topology->cells, parts_->known);
  parts_->update_copies();
  parts_->n_frames = facts.n_frames;
  parts_->report.known = parts_->generations.anchors();
  parts_->report.filled = parts_->generations.reached();
  parts_->report.disconnected = parts_->generations.disconnected_vertices();
  parts_->report.iterations = facts.iterations;
  parts_->report.distance = facts.distance;
  parts_->report.aligned = facts.aligned != 0;
  parts_->report.stages.prior_weight = facts.prior_weight;
  parts_->report.stages.prior_share = facts.prior_share;
  parts_->report.standard_error = parts_->mean_standard_error();
}

// Only the members defined in this file; tracker.cpp instantiates the others.
template std::size_t Tracker<float>::state_size() const;
template std::size_t Tracker<double>::state_size() const;
template std::vector<std::byte> Tracker<float>::state() const;
template std::vector<std::byte> Tracker<double>::state() const;
template void Tracker<float>::restore(std::span<const std::byte>);
template void Tracker<double>::restore(std::span<const std::byte>);

}  // namespace dynmesh
