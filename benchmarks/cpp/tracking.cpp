/// C functions that track a template with other constants than those of the library, for
/// `benchmarks/tracking_constants.py`.
///
/// Positions are packed rows of float. Nothing is checked.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/tracker.hpp>
#include <exception>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "support/workers.hpp"
#include "tracker/camera_arguments.hpp"
#include "tracking/depth_images.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/surface_tracking.hpp"

namespace dynmesh {
namespace {

using Number = double TrackingConstants::*;
using Count = int TrackingConstants::*;

constexpr std::pair<std::string_view, Number> numbers[] = {
    {"prediction", &TrackingConstants::prediction},
    {"rigid_radius", &TrackingConstants::rigid_radius},
    {"rigid_scale", &TrackingConstants::rigid_scale},
    {"rigid_caution", &TrackingConstants::rigid_caution},
    {"first_weight", &TrackingConstants::first_weight},
    {"last_weight", &TrackingConstants::last_weight},
    {"wide_radius", &TrackingConstants::wide_radius},
    {"narrow_radius", &TrackingConstants::narrow_radius},
    {"scale", &TrackingConstants::scale},
    {"side", &TrackingConstants::side},
    {"vertices_per_point", &TrackingConstants::vertices_per_point},
    {"agreement", &TrackingConstants::agreement},
    {"pull", &TrackingConstants::pull},
    {"least_unexplained", &TrackingConstants::least_unexplained},
    {"drawing_radius", &TrackingConstants::drawing_radius},
    {"drawing_scale", &TrackingConstants::drawing_scale},
    {"drawing_weight", &TrackingConstants::drawing_weight},
    {"largest_limb", &TrackingConstants::largest_limb},
    {"lost_share", &TrackingConstants::lost_share},
    {"pixel", &TrackingConstants::pixel},
    {"thickness", &TrackingConstants::thickness},
    {"back_thickness", &TrackingConstants::back_thickness},
    {"jump", &TrackingConstants::jump},
};
constexpr std::pair<std::string_view, Count> counts[] = {
    {"rigid_steps", &TrackingConstants::rigid_steps},
    {"rigid_vertices", &TrackingConstants::rigid_vertices},
    {"iterations", &TrackingConstants::iterations},
    {"steps", &TrackingConstants::steps},
    {"examined_points", &TrackingConstants::examined_points},
    {"most_searches", &TrackingConstants::most_searches},
};

/// Returns the constant of a name, NaN if there is none.
double constant(const TrackingConstants& constants, std::string_view name) {
  for (const auto& [known, member] : numbers) {
    if (name == known) return constants.*member;
  }
  for (const auto& [known, member] : counts) {
    if (name == known) return constants.*member;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// Changes a constant; counts are rounded. Returns whether there is one of that name.
bool change(TrackingConstants& constants, std::string_view name, double value) {
  for (const auto& [known, member] : numbers) {
    if (name != known) continue;
    constants.*member = value;
    return true;
  }
  for (const auto& [known, member] : counts) {
    if (name != known) continue;
    constants.*member = static_cast<int>(std::lround(value));
    return true;
  }
  return false;
}

/// The tracking of the library without arguments, components out of sight, and provenance.
class Subject {
 public:
  Subject(Faces faces, std::vector<Vector3<double>> first_frame, const TrackingConstants& constants)
      : topology_(build_topology(faces, first_frame.size())),
        workers_(1),
        surface_(triangles(faces), topology_, workers_, constants) {
    surface_.reset(first_frame);
  }

  SurfaceTracking::Found track(const Measurement& measurement) {
    const auto found = surface_.track(measurement);
    surface_.remember(found.x, found.iterations > 0);
    return found;
  }

  PointScan scan;
  DepthImages images;

  void prepare_images() {
    images.prepare(surface_.constants().jump * surface_.mean_edge(), workers_);
  }

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

/// Writes the positions, and returns the number of iterations, or -1 if the scan was refused.
int finish(Subject& subject, const Measurement& measurement, float* tracked) {
  try {
    const auto found = subject.track(measurement);
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

}  // namespace
}  // namespace dynmesh

extern "C" {
#define DYNMESH_FOR_PYTHON __attribute__((visibility("default")))

/// Returns the value of a constant in the library, NaN if there is none of that name.
DYNMESH_FOR_PYTHON double tracking_constant(const char* name) {
  return dynmesh::constant({}, name);
}

/// Begins tracking with `n` constants changed. Returns null if the library refuses the arguments.
DYNMESH_FOR_PYTHON void* tracking_create(const std::int32_t* faces, std::size_t n_faces,
                                         const float* first_frame, std::size_t n_vertices,
                                         const char* const* names, const double* values,
                                         std::size_t n) {
  using namespace dynmesh;
  try {
    TrackingConstants constants;
    for (std::size_t i = 0; i < n; ++i) {
      if (!change(constants, names[i], values[i])) return nullptr;
    }
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

/// Tracks `n` points with unit normals, which sensors at `n_viewpoints` places measured.
DYNMESH_FOR_PYTHON int tracking_push(void* subject, const float* points, const float* normals,
                                     std::size_t n, const float* viewpoints,
                                     std::size_t n_viewpoints, float* tracked) {
  using namespace dynmesh;
  auto& pushed = *static_cast<Subject*>(subject);
  pushed.scan.points = rows(points, n);
  pushed.scan.normals = rows(normals, n);
  pushed.scan.sensors = rows(viewpoints, n_viewpoints);
  pushed.scan.index();
  return finish(pushed, pushed.scan, tracked);
}

/// Tracks `n` depth images of the same size; intrinsics (n, 3, 3), poses (n, 4, 4).
DYNMESH_FOR_PYTHON int tracking_push_depth(void* subject, const float* depths, std::size_t n,
                                           std::size_t height, std::size_t width,
                                           const double* intrinsics, const double* poses,
                                           float* tracked) {
  using namespace dynmesh;
  auto& pushed = *static_cast<Subject*>(subject);
  pushed.images.clear();
  for (std::size_t i = 0; i < n; ++i) {
    DepthImage image;
    image.data = depths + i * height * width;
    image.height = height;
    image.width = width;
    image.row_stride = static_cast<std::ptrdiff_t>(width);
    std::copy_n(intrinsics + 9 * i, 9, image.intrinsics.begin());
    std::copy_n(poses + 16 * i, 16, image.pose.begin());
    copy_depths(image, pushed.images.add(camera_of(image), height, width));
  }
  pushed.prepare_images();
  return finish(pushed, pushed.images, tracked);
}
}
