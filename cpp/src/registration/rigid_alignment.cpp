#include "registration/rigid_alignment.hpp"

#include <Eigen/Core>

#include "base/arguments.hpp"
#include "base/checks.hpp"
#include "base/default_arithmetic.hpp"
#include "base/geometry.hpp"
#include "base/workers.hpp"
#include "mesh/faces.hpp"
#include "registration/rigid_starts.hpp"
#include "surface_fit/scan_arguments.hpp"

namespace dynmesh {
namespace {

/// Of a scan, about so many points are used at most, whose normals are estimated.
constexpr std::size_t most_points = 20000;

std::vector<double> coordinates_of(Field points) {
  std::vector<double> coordinates;
  for (const auto& p : points) coordinates.insert(coordinates.end(), {p.x, p.y, p.z});
  return coordinates;
}

}  // namespace

RigidAlignment align_rigidly(Faces faces, Points<const double> first_frame,
                             Points<const double> scan) {
  const DefaultArithmetic arithmetic;
  const auto frame = first_frame_of(first_frame);
  const Topology topology = checked_topology(faces, frame.size());
  const auto points = checked_rows("scan", scan);
  if (points.empty()) refuse("scan", "has no points");
  const auto triangles = triangles_of(faces);

  PointScan measured;
  const std::size_t step = 1 + points.size() / most_points;
  for (std::size_t i = 0; i < points.size(); i += step) measured.points.push_back(points[i]);
  RigidAlignment found;
  found.mean_edge = mean_edge_length(topology.cells, frame);
  Workers alone(1);
  measured.estimate_normals(found.mean_edge, alone);
  const PointScan sample = sample_scan(measured, rigid_start_constants.points);
  const auto places = sample_surface(triangles, frame, rigid_start_constants.places).points;
  // A surface without an area has vertices.
  found.surface = coordinates_of(places.empty() ? frame : places);
  found.scan = coordinates_of(sample.points);
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(found.motion.data()) =
      rigid_starts(triangles, frame, sample).front().matrix();
  return found;
}

}  // namespace dynmesh
