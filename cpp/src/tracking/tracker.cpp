#include <algorithm>
#include <chrono>
#include <cmath>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "completer/arguments.hpp"
#include "support/geometry.hpp"
#include "tracking/camera_arguments.hpp"
#include "tracking/parts.hpp"

namespace dynmesh {

using Clock = std::chrono::steady_clock;

namespace {

/// More points than 32-bit indices can count are refused.
template <class Real>
void check_scan(const char* argument, const Points<const Real>& rows) {
  if (rows.count > static_cast<std::size_t>(std::numeric_limits<Index>::max())) {
    throw std::invalid_argument(std::string(argument) + ": has " + std::to_string(rows.count) +
                                " rows, more than 32-bit indices can count");
  }
  check_view(argument, rows);
  for (std::size_t i = 0; i < rows.count; ++i) {
    check_position(argument, "row", i, row(rows, i), "all rows must be finite");
  }
}

template <class Real>
void copy(const Points<const Real>& rows, std::vector<Vector3<double>>& copies) {
  copies.resize(rows.count);
  for (std::size_t i = 0; i < rows.count; ++i) copies[i] = in_double(row(rows, i));
}

/// Copies normals at unit length. Those of length 0 stay 0.
template <class Real>
void copy_directions(const Points<const Real>& rows, std::vector<Vector3<double>>& copies) {
  copies.resize(rows.count);
  for (std::size_t i = 0; i < rows.count; ++i) {
    const auto normal = in_double(row(rows, i));
    // Divided by the largest coordinate first, so that squares stay in range.
    const double largest = std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
    if (!(largest > 0)) {
      copies[i] = {};
      continue;
    }
    const Vector3<double> scaled = {normal.x / largest, normal.y / largest, normal.z / largest};
    copies[i] = (1 / std::sqrt(squared_norm(scaled))) * scaled;
  }
}

}  // namespace

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame,
                       const TrackerSettings& settings) {
  check_settings({.threads = settings.threads});
  const auto frame = first_frame_of(first_frame);
  parts_ = std::make_unique<Parts>(faces, frame, topology_of(faces, frame.size()), settings);
}

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame, const TrackerSettings& settings,
                       const Training<Real>& training) {
  check_settings({.threads = settings.threads});
  const auto frame = first_frame_of(first_frame);
  check_training(training, frame.size());
  check_size(training, first_frame);
  parts_ = std::make_unique<Parts>(faces, frame, topology_of(faces, frame.size()), settings,
                                   training.frames());
}

template <class Real>
Tracker<Real>::~Tracker() = default;
template <class Real>
Tracker<Real>::Tracker(Tracker&&) noexcept = default;
template <class Real>
Tracker<Real>& Tracker<Real>::operator=(Tracker&&) noexcept = default;

template <class Real>
void Tracker<Real>::reset(Points<const Real> frame) {
  check_rows("frame", frame, n_vertices());
  parts_->begin(to_internal_order(parts_->numbering, complete_frame("frame", frame)));
}

template <class Real>
TrackingReport Tracker<Real>::push(const Scan<Real>& scan, Points<Real> tracked) {
  const auto start = Clock::now();
  check_scan("points", scan.points);
  const bool has_normals = scan.normals.data != nullptr;
  if (has_normals) {
    if (scan.normals.count != scan.points.count) {
      throw std::invalid_argument("normals: has " + std::to_string(scan.normals.count) +
                                  " rows, but points has " + std::to_string(scan.points.count));
    }
    check_scan("normals", scan.normals);
  }
  check_scan("viewpoints", scan.viewpoints);
  check_output(tracked, n_vertices(),
               {{"points", Extent::of(scan.points)},
                {"normals", Extent::of(scan.normals)},
                {"viewpoints", Extent::of(scan.viewpoints)}});
  PointScan& measured = parts_->scan;
  copy(scan.points, measured.points);
  copy(scan.viewpoints, measured.sensors);
  measured.index();
  if (has_normals) {
    copy_directions(scan.normals, measured.normals);
    measured.undecided.clear();
  } else {
    measured.estimate_normals(parts_->workers);
  }
  return parts_->track(measured, tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::push_depth(std::span<const DepthImage> images, Points<Real> tracked) {
  const auto start = Clock::now();
  check_output(tracked, n_vertices(), {});
  for (std::size_t i = 0; i < images.size(); ++i) check_depth_image(i, images[i]);
  DepthImages& measured = parts_->images;
  measured.clear();
  for (const DepthImage& image : images) {
    copy_depths(image, measured.add(camera_of(image), image.height, image.width));
  }
  measured.prepare(parts_->surface.constants().jump * parts_->surface.mean_edge(), parts_->workers);
  return parts_->track(measured, tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::skip(Points<Real> tracked) {
  const auto start = Clock::now();
  check_output(tracked, n_vertices(), {});
  parts_->images.clear();
  return parts_->track(parts_->images, tracked, start);
}

template <class Real>
std::size_t Tracker<Real>::n_vertices() const {
  return parts_->n_vertices();
}
template <class Real>
std::size_t Tracker<Real>::n_edges() const {
  return parts_->topology->cells.neighbours.size() / 2;
}
template <class Real>
std::size_t Tracker<Real>::n_frames() const {
  return parts_->n_frames;
}
template <class Real>
const TrackerSettings& Tracker<Real>::settings() const {
  return parts_->settings;
}
template <class Real>
const TopologyReport& Tracker<Real>::topology() const {
  return parts_->topology->report;
}
template <class Real>
std::span<const std::uint8_t> Tracker<Real>::observed() const {
  return parts_->observed_for_caller;
}
template <class Real>
std::span<const Index> Tracker<Real>::generation() const {
  return parts_->generation_for_caller;
}
template <class Real>
std::span<const Index> Tracker<Real>::age() const {
  return parts_->age_for_caller;
}
template <class Real>
std::span<const Real> Tracker<Real>::standard_error() const {
  if (!settings().uncertainty) {
    throw std::invalid_argument("standard_error: requires uncertainty=True");
  }
  return parts_->standard_error_for_caller;
}
template <class Real>
const TrackingReport& Tracker<Real>::report() const {
  return parts_->report;
}

template class Tracker<float>;
template class Tracker<double>;

}  // namespace dynmesh
