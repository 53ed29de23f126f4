/// C functions that track a template with other constants than those of the library, for
/// `benchmarks/compiled.py`.
///
/// Positions are packed rows of float. Nothing is checked.
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/tracker.hpp>
#include <exception>
#include <memory>
#include <vector>

#include "constants.hpp"
#include "support/workers.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/surface_tracking.hpp"

namespace dynmesh {
namespace {

/// The tracking of the library without arguments, components out of sight, and provenance.
class Subject {
 public:
  Subject(Faces faces, std::vector<Vector3<double>> first_frame, const TrackingConstants& constants)
      : topology_(build_topology(faces, first_frame.size())),
        workers_(1),
        surface_(triangles(faces), topology_, workers_, constants) {
    surface_.reset(first_frame);
  }

  SurfaceTracking::Found track(const PointScan& measurement) {
    const auto found = surface_.track(measurement);
    surface_.remember(found.x, found.iterations > 0);
    return found;
  }

  PointScan scan;

 private:
  static std::vector<Triangle> triangles(Faces faces) {
    std::vector<Triangle> copies(faces.count);
    for (std::size_t f = 0; f < faces.count; ++f) copies[f] = faces[f];
    return copies;
  }

  Topology topology_;
  Workers workers_;
  SurfaceTracking surface_;
};

std::vector<Vector3<double>> rows(const float* values, std::size_t n) {
  std::vector<Vector3<double>> copies(n);
  for (std::size_t i = 0; i < n; ++i) {
    copies[i] = {static_cast<double>(values[3 * i]), static_cast<double>(values[3 * i + 1]),
                 static_cast<double>(values[3 * i + 2])};
  }
  return copies;
}

}  // namespace
}  // namespace dynmesh

extern "C" {
#define DYNMESH_FOR_PYTHON __attribute__((visibility("default")))

/// Returns the name of a constant by its number, and writes its value; null after the last one.
DYNMESH_FOR_PYTHON const char* tracking_constant(std::size_t number, double* value) {
  return dynmesh::nth<dynmesh::TrackingConstants>(dynmesh::tracking_constants, number, *value);
}

/// Begins tracking with one constant multiplied by a factor. Returns null if the library refuses
/// the arguments.
DYNMESH_FOR_PYTHON void* tracking_create(const std::int32_t* faces, std::size_t n_faces,
                                         const float* first_frame, std::size_t n_vertices,
                                         const char* constant, double factor) {
  using namespace dynmesh;
  try {
    TrackingConstants constants;
    if (!scale<TrackingConstants>(constants, tracking_constants, constant, factor)) return nullptr;
    return std::make_unique<Subject>(Faces{faces, n_faces}, rows(first_frame, n_vertices),
                                     constants)
        .release();
  } catch (const std::exception&) {
    return nullptr;
  }
}

DYNMESH_FOR_PYTHON void tracking_destroy(void* subject) {
  delete static_cast<dynmesh::Subject*>(subject);
}

/// Tracks `n` points with unit normals, which sensors at `n_viewpoints` places measured. Writes the
/// positions, and returns the number of iterations, or -1 if the scan was refused.
DYNMESH_FOR_PYTHON int tracking_push(void* subject, const float* points, const float* normals,
                                     std::size_t n, const float* viewpoints,
                                     std::size_t n_viewpoints, float* tracked) {
  using namespace dynmesh;
  auto& pushed = *static_cast<Subject*>(subject);
  pushed.scan.points = rows(points, n);
  pushed.scan.normals = rows(normals, n);
  pushed.scan.sensors = rows(viewpoints, n_viewpoints);
  pushed.scan.index();
  try {
    const auto found = pushed.track(pushed.scan);
    for (std::size_t v = 0; v < found.x.size(); ++v) {
      tracked[3 * v] = static_cast<float>(found.x[v].x);
      tracked[3 * v + 1] = static_cast<float>(found.x[v].y);
      tracked[3 * v + 2] = static_cast<float>(found.x[v].z);
    }
    return found.iterations;
  } catch (const std::exception&) {
    return -1;
  }
}
}
