#include "stream/stream.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/kernels.hpp"
#include "stream/arguments.hpp"
#include "stream/state.hpp"
#include "support/stored_numbers.hpp"

namespace dynmesh {

std::vector<Triangle> triangles_of(Faces faces) {
  std::vector<Triangle> triangles;
  for (std::size_t f = 0; f < faces.count; ++f) triangles.push_back(faces[f]);
  return triangles;
}

template <class Real>
TrainingFrames frames_of(const Training<Real>* training, Points<const Real> first_frame) {
  TrainingFrames frames;
  if (training == nullptr) return frames;
  check_training(*training, first_frame);
  for (const auto& positions : training->frames()) {
    const Points<const Real> rows(positions.data(), positions.size() / 3);
    auto& frame = frames.emplace_back();
    for (std::size_t v = 0; v < rows.count; ++v) frame.push_back(in_double(row(rows, v)));
  }
  return frames;
}

template <class Real>
StreamMesh::StreamMesh(Faces mesh_faces, Points<const Real> first_frame, Index threads,
                       const TaskSharing& sharing, const Training<Real>* training_frames)
    : training(frames_of(training_frames, first_frame)),
      topology(topology_of(mesh_faces, first_frame.count)),
      faces(triangles_of(mesh_faces)),
      workers(threads, sharing) {
  if (training_frames == nullptr) return;
  for (const auto& positions : training_frames->frames()) {
    training_hash = training_hash * 31 + (hash_of(std::as_bytes(std::span(positions))) | 1);
  }
}

template <class Real>
Stream<Real>::Stream(StreamMesh& mesh, Frame frame, DisconnectedRule rule)
    : generations(frame.size()),
      first_frame(std::move(frame)),
      previous(first_frame),
      known(first_frame.size(), 1),
      age(first_frame.size()),
      current(first_frame.size()),
      current_known(first_frame.size()),
      mesh_(mesh),
      disconnected_(mesh.topology, rule, first_frame) {
  generations.classify(mesh.topology.cells, known);
}

/// Packed rows are copied by faster loops.
template <class Real>
void Stream<Real>::read(Points<const Real> rows, KnownMask mask) {
  const bool is_packed =
      rows.row_stride == 3 && rows.column_stride == 1 && (mask.data == nullptr || mask.stride == 1);
  std::atomic<bool> in_range{true};
  mesh_.workers.for_each_chunk(static_cast<Index>(n_vertices()), [&](Index first, Index last) {
    bool good = true;
    if (is_packed) {
      good = best_kernels().sweeps<Real>().read(rows.data, mask.data, largest_coordinate<Real>,
                                                first, last, &current[0].x, current_known.data());
    } else {
      for (Index v = first; v < last; ++v) {
        current[v] = row(rows, v);
        current_known[v] = (mask.data == nullptr ? is_finite(current[v]) : mask[v]) ? 1 : 0;
        good = good && (current_known[v] == 0 || is_in_range(current[v]));
      }
    }
    if (!good) in_range.store(false, std::memory_order_relaxed);
  });
  for (std::size_t v = 0; v < n_vertices() && !in_range; ++v) {
    if (current_known[v] != 0) check_known_position(v, current[v]);
  }
}

template <class Real>
void Stream<Real>::write(Points<Real> completed, std::span<const Quaternion> rotations) {
  disconnected_.complete(previous, current, generations, rotations);
  const bool is_packed = completed.row_stride == 3 && completed.column_stride == 1;
  mesh_.workers.for_each_chunk(static_cast<Index>(n_vertices()), [&](Index first, Index last) {
    if (is_packed) {
      best_kernels().sweeps<Real>().write(&current[0].x, &previous[0].x, largest_coordinate<Real>,
                                          first, last, completed.data);
      return;
    }
    for (Index v = first; v < last; ++v) {
      if (!is_in_range(current[v])) current[v] = previous[v];
      put_row(completed, v, current[v]);
    }
  });
}

template <class Real>
void Stream<Real>::advance() {
  std::swap(previous, current);
  std::swap(known, current_known);
  for (std::size_t v = 0; v < age.size(); ++v) {
    const Index older = age[v] + (age[v] < std::numeric_limits<Index>::max() ? 1 : 0);
    age[v] = known[v] != 0 ? 0 : older;
  }
  if (n_frames < std::numeric_limits<std::size_t>::max()) ++n_frames;
}

/// The checksum of a state detects damage but not bytes that were made up. This refuses all values
/// that later frames cannot handle, wherever the bytes come from.
template <class Real>
void Stream<Real>::recall() {
  check_stored_frame(previous);
  for (std::size_t v = 0; v < age.size(); ++v) {
    if (age[v] >= 0 && known[v] <= 1) continue;
    refuse_state(joined("vertex ", v, " has the age ", age[v], " and the mask ", known[v],
                        ", which is not possible"));
  }
  generations.classify(mesh_.topology.cells, known);
}

template <class Real>
void Stream<Real>::keep(std::span<const double> errors) {
  standard_error.resize(errors.size());
  std::ranges::transform(errors, standard_error.begin(), [](double error) {
    return std::isinf(error) ? std::numeric_limits<Real>::infinity() : saturated<Real>(error);
  });
}

template <class Real>
void Stream<Real>::count(FrameReport& report) const {
  report.known = generations.anchors();
  report.filled = generations.reached();
  report.disconnected = generations.disconnected_vertices();
}

template TrainingFrames frames_of(const Training<float>*, Points<const float>);
template TrainingFrames frames_of(const Training<double>*, Points<const double>);
template StreamMesh::StreamMesh(Faces, Points<const float>, Index, const TaskSharing&,
                                const Training<float>*);
template StreamMesh::StreamMesh(Faces, Points<const double>, Index, const TaskSharing&,
                                const Training<double>*);
template class Stream<float>;
template class Stream<double>;

}  // namespace dynmesh
