#include "tracking/surface_tracking.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/geometry.hpp"
#include "tracking/vertex_normals.hpp"

namespace dynmesh {

SurfaceTracking::SurfaceTracking(std::vector<Triangle> faces, const Topology& topology,
                                 Workers& workers, const TrackingConstants& constants)
    : constants_(constants),
      faces_(std::move(faces)),
      topology_(topology),
      workers_(workers),
      system_(topology.cells, workers),
      rotations_(topology.cells, workers),
      fit_(topology.cells.size()),
      anchors_(topology.cells.size(), true),
      first_shape_(topology.cells.size()),
      shape_(topology.cells.size()),
      target_(topology.cells.size()),
      x_(topology.cells.size()),
      previous_(topology.cells.size()),
      before_(topology.cells.size()),
      normals_(topology.cells.size()),
      found_(topology.cells.size()) {
  rotations_.allow_averaging();
}

void SurfaceTracking::reset(Field first_frame) {
  system_.reset(system_.prepare<double>(faces_, first_frame, detail_constants_));
  mean_edge_ = mean_edge_length(topology_.cells, first_frame);
  rotations_.reset(first_frame, mean_edge_);
  system_.apply(first_frame, 1, first_shape_);
  shape_ = first_shape_;
  std::ranges::copy(first_frame, previous_.begin());
  before_ = previous_;
}

void SurfaceTracking::correspond(const Measurement& measurement, Field viewpoints, double radius,
                                 double scale, double weight) {
  find_vertex_normals(faces_, x_, normals_);
  workers_.for_each_short_chunk(static_cast<Index>(x_.size()), [&](Index first, Index last) {
    for (auto v = static_cast<std::size_t>(first); v < static_cast<std::size_t>(last); ++v) {
      Correspondence& c = found_[v];
      c = {};
      bool faces_a_sensor = viewpoints.empty();
      for (const auto& from : viewpoints) {
        const auto view = from - x_[v];
        faces_a_sensor |= dot(normals_[v], view) > constants_.facing * std::sqrt(squared_norm(view));
      }
      if (!faces_a_sensor) continue;
      c = measurement.nearest(x_[v], normals_[v], radius, constants_.agreement);
      if (c.weight == 0) continue;
      const auto offset = c.point - x_[v];
      const double distance2 = squared_norm(offset);
      const double along = dot(offset, c.normal);
      const double lateral2 = distance2 - along * along;
      const double unit = scale * mean_edge_;
      c.weight = weight / (1 + distance2 / (unit * unit));
      const double side = constants_.lateral * mean_edge_;
      c.weight /= 1 + lateral2 / (side * side);
    }
  });
}

SurfaceTracking::Field SurfaceTracking::find(const Measurement& measurement, Field viewpoints) {
  const std::size_t k = x_.size();
  for (std::size_t v = 0; v < k; ++v) {
    x_[v] = previous_[v] + constants_.prediction * (previous_[v] - before_[v]);
  }
  std::ranges::fill(anchors_.is_solved, std::uint8_t{1});
  for (int pass = 0; pass < constants_.passes; ++pass) {
    const bool is_wide = pass < constants_.wide_passes;
    const double radius = (is_wide ? constants_.wide : constants_.narrow) * mean_edge_;
    correspond(measurement, viewpoints, radius, is_wide ? constants_.scale_first : constants_.scale,
               is_wide ? constants_.weight : constants_.weight * constants_.weight_growth);
    rotations_.fit(x_, constants_.averagings);
    for (std::size_t v = 0; v < k; ++v) {
      target_[v] = shape_[v] + constants_.pull * (first_shape_[v] - shape_[v]);
      anchors_.weights[v] = constants_.precondition * found_[v].weight;
    }
    rotations_.turn(target_, normals_);
    system_.factorize(anchors_);
    fit_.take_steps(system_, normals_, found_, constants_.steps, x_);
  }
  std::swap(before_, previous_);
  previous_ = x_;
  rotations_.fit(x_, constants_.memory_averagings);
  system_.apply(x_, 1, target_);
  rotations_.turn_back(target_, shape_);
  return x_;
}

}  // namespace dynmesh
