#include "completer/training_summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "detail/modes.hpp"
#include "mesh/numbering.hpp"
#include "mesh/training_frames.hpp"
#include "stream/arguments.hpp"
#include "support/rigid_motion.hpp"
#include "support/workers.hpp"

namespace dynmesh {
namespace {

/// The part that holds every vertex, alone.
SurfaceParts whole_surface(std::size_t n_vertices) {
  SurfaceParts whole;
  whole.offsets.resize(n_vertices + 1);
  std::iota(whole.offsets.begin(), whole.offsets.end(), 0);
  whole.entries.assign(n_vertices, {0, 1.0});
  return whole;
}

/// The root mean square distance of the vertices after the best rigid motion.
double distance_between(std::span<const Vector3<double>> before,
                        std::span<const Vector3<double>> first) {
  const RigidMotion motion = fit_rigid_motion<double>(before, first);
  double squares = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    const Vector3<double> left = motion.apply(before[v]) - first[v];
    squares += left.x * left.x + left.y * left.y + left.z * left.z;
  }
  return std::sqrt(squares / static_cast<double>(before.size()));
}

}  // namespace

template <class Real>
TrainingSummary summarise(Faces faces, Points<const Real> first_frame,
                          const Training<Real>& training) {
  const auto frame = first_frame_of(first_frame);
  check_training(training, frame.size());
  check_size(training, first_frame);
  const Topology topology = topology_of(faces, frame.size());

  const auto first = widened(frame);
  const TrainingFrames frames = take_in_internal_order<Real>(training.frames(), {});
  TrainingSummary summary;
  summary.frames = training.n_added();
  for (const auto& trained : frames) {
    const double distance = distance_between(trained, first);
    summary.rms_distance += distance * distance;
    summary.largest_distance = std::max(summary.largest_distance, distance);
  }
  summary.rms_distance = std::sqrt(summary.rms_distance / static_cast<double>(frames.size()));

  const auto triangles = faces_in_internal_order(faces, {});
  const DetailConstants constants;
  const auto k = build_detail_operator(triangles, topology.cells, first, constants);
  const double mean_edge = mean_edge_length<double>(topology.cells, first);
  Workers workers(1);
  const Rounding rounding(k, mean_edge, std::numeric_limits<Real>::epsilon());
  const Modes modes = training_modes(frames, whole_surface(first.size()), k, topology.cells, first,
                                     mean_edge, rounding, constants, workers);
  summary.variance_held = modes.variance_held();
  return summary;
}

template TrainingSummary summarise(Faces, Points<const float>, const Training<float>&);
template TrainingSummary summarise(Faces, Points<const double>, const Training<double>&);

}  // namespace dynmesh
