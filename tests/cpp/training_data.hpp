/// Training frames: those of a mesh that bends in a few ways.
#pragma once

#include <cmath>
#include <cstddef>
#include <dynmesh/completer.hpp>
#include <dynmesh/training.hpp>
#include <vector>

#include "meshes.hpp"

namespace dynmesh::testing {

/// The vertices at this time, bent along two axes, each with its own rhythm.
template <class Real>
std::vector<Real> bent(const std::vector<Real>& vertices, double time) {
  std::vector<Real> frame = vertices;
  for (std::size_t i = 0; i < frame.size(); i += 3) {
    const double x = vertices[i];
    const double y = vertices[i + 1];
    frame[i + 1] += static_cast<Real>(0.4 * std::sin(1.3 * time) * std::sin(0.25 * x));
    frame[i + 2] += static_cast<Real>(2 * std::sin(0.9 * time) * std::sin(0.3 * x) +
                                      1.5 * std::cos(1.7 * time) * std::cos(0.25 * y));
  }
  return frame;
}

/// Training frames, at times that no whole number has.
template <class Real>
std::vector<std::vector<Real>> training_frames_of(const std::vector<Real>& vertices, int n_frames) {
  std::vector<std::vector<Real>> shown;
  for (int n = 0; n < n_frames; ++n) shown.push_back(bent(vertices, 0.37 + 0.71 * n));
  return shown;
}

template <class Real>
Training<Real> training_of(const std::vector<std::vector<Real>>& shown) {
  Training<Real> training(shown.front().size() / 3);
  for (const auto& frame : shown) training.add({frame.data(), frame.size() / 3});
  return training;
}

/// A completer of method detail that has learned from `n_frames` of the mesh.
template <class Real>
Completer<Real> trained(const Mesh<Real>& mesh, Settings settings = {}, int n_frames = 6) {
  settings.method = Method::detail;
  return {mesh.faces(), mesh.points(), settings,
          training_of(training_frames_of(mesh.vertices, n_frames))};
}

}  // namespace dynmesh::testing
