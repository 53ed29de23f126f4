/// Registration of a template with one scan: the mesh, in the shape of the scan.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/export.hpp>
#include <dynmesh/quality.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/training.hpp>
#include <dynmesh/types.hpp>
#include <functional>
#include <span>
#include <vector>

namespace dynmesh {

/// A template that was registered with a scan, and how it lies there. The quality is also doubtful
/// if a landmark is not where it belongs. Arrays have a row for each vertex.
template <class Real>
struct Registration : Measure {
  std::vector<Real> vertices;          ///< x, y, z of each vertex, in the unit of the points
  std::vector<std::uint8_t> observed;  ///< 1 if the vertex has a measured point, 0 if not
  /// As Tracker::standard_error; empty without `uncertainty`.
  std::vector<Real> standard_error;
  /// Row by row, the motion that brings the template closest to the vertices (Kabsch 1976): rigid,
  /// and with `scale` a similarity.
  std::array<double, 16> transform{};
  double scale = 1;        ///< the length of the unit of the template in that of the points
  std::size_t rounds = 0;  ///< how often the whole surface was drawn into the scan
  bool converged = false;  ///< whether the vertices had stopped moving then
};

/// Points of the scan that belong to vertices of the template.
template <class Real>
struct Landmarks {
  std::span<const Index> vertices;    ///< (n,) different ones
  Points<const Real> positions = {};  ///< (n, 3) different ones, near the points of the scan
};

struct RegistrationSettings {
  /// Whether the rigid motion that puts the template into the scan is sought. If not, the template
  /// must be where the scan is.
  bool align = true;
  /// Whether the template may have any other size than what was scanned.
  bool scale = false;
  bool uncertainty = false;  ///< whether standard errors are wanted
  Index threads = 1;         ///< as TrackerSettings::threads
  /// Called before each step of the search, unless it is empty. What it throws is passed on, so it
  /// can stop the work.
  std::function<void()> before_step = {};
};

/// Finds a template in a scan: first rigidly, by at least three landmarks that are not on a line or
/// else from any rotation, then with a coarse mesh, and at last as Tracker does, until the vertices
/// stop. See docs/reference/tracking.md.
///
/// `faces` and `positions` are the template, (k, 3), complete and finite, in any pose. The scan may
/// show it partially. With landmarks, poses that are far from that of the template are found more
/// often. `training`, which may be null, are other frames of the template, as for Tracker.
///
/// Throws std::invalid_argument for bad input, with a message that says what is wrong, where, and
/// with which value: a template or a scan that Tracker would refuse, fewer than 12 points, a
/// landmark of a vertex that does not exist or of one that has another, two landmarks at the same
/// position, one far outside the scan, and sizes that differ by a factor of more than 20, if
/// `scale` is not set. A scan of something else is not refused; its quality is `ruined`.
template <class Real>
DYNMESH_EXPORT Registration<Real> register_template(Faces faces, Points<const Real> positions,
                                                    const Scan<Real>& scan,
                                                    const Landmarks<Real>& landmarks = {},
                                                    const RegistrationSettings& settings = {},
                                                    const Training<Real>* training = nullptr);

/// Registers the template to the depth images of one or several cameras of the same moment.
template <class Real>
DYNMESH_EXPORT Registration<Real> register_template(Faces faces, Points<const Real> positions,
                                                    std::span<const DepthImage> images,
                                                    const Landmarks<Real>& landmarks = {},
                                                    const RegistrationSettings& settings = {},
                                                    const Training<Real>* training = nullptr);

}  // namespace dynmesh
