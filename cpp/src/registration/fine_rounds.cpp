#include "registration/fine_rounds.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {

FineRounds::FineRounds(std::vector<Triangle> faces, Stream<double>& stream, TrainingFrames training,
                       bool has_uncertainty, double epsilon, const RegistrationConstants& constants,
                       const TrackingConstants& tracking)
    : constants_(constants),
      stream_(stream),
      faces_(std::move(faces)),
      training_(std::move(training)),
      has_uncertainty_(has_uncertainty),
      epsilon_(epsilon),
      tracking_(tracking),
      written_(3 * stream.n_vertices()) {}

FineRounds::Result FineRounds::run(const PointScan& scan, Field first_frame, Field start,
                                   int most_rounds) {
  surface_.emplace(faces_, *stream_.topology, stream_.workers, first_frame, tracking_, training_,
                   has_uncertainty_, epsilon_);
  surface_->remember(start, true);
  const std::vector<Vector3<double>> frame(first_frame.begin(), first_frame.end());
  stream_.begin(stream_.prepare(to_caller_order(stream_.numbering, frame)));
  stream_.recall({start.begin(), start.end()}, std::vector<Index>(start.size()), stream_.known, 0);
  Result result;
  while (!result.converged && result.rounds < static_cast<std::size_t>(most_rounds)) {
    result.converged = take(scan) < constants_.settled * surface_->mean_edge();
    ++result.rounds;
  }
  return result;
}

/// Takes one round, and returns how far the vertices have moved on average.
double FineRounds::take(const PointScan& scan) {
  const auto found = surface_->track(scan);
  std::ranges::copy(found.observed, stream_.known.begin());
  stream_.generations.classify(stream_.topology->cells, stream_.known);
  const auto generation = stream_.generations.of_vertices();
  for (std::size_t v = 0; v < stream_.current.size(); ++v) {
    const bool is_found = generation[v] != Generations::disconnected;
    stream_.current[v] = is_found ? found.x[v] : stream_.previous[v];
  }
  stream_.write({written_.data(), stream_.n_vertices()});
  surface_->measure_errors(stream_.generations);
  double moved = 0;
  for (std::size_t v = 0; v < stream_.current.size(); ++v) {
    moved += std::sqrt(squared_norm(stream_.current[v] - stream_.previous[v])) /
             static_cast<double>(stream_.current.size());
  }
  surface_->remember(stream_.current, stream_.generations.anchors() > 0);
  stream_.advance();
  return moved;
}

}  // namespace dynmesh
