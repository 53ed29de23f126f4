// Completes a frame, and catches what dynmesh throws.
#include <array>
#include <dynmesh/dynmesh.hpp>
#include <limits>

extern "C" __attribute__((visibility("default"))) double height_of_last(double height) {
  const std::array<dynmesh::Index, 6> faces = {0, 1, 2, 2, 1, 3};
  std::array<double, 12> frame = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  const dynmesh::Points<double> points(frame.data(), 4);
  dynmesh::Completer<double> completer({faces.data(), 2}, points);
  frame.fill(std::numeric_limits<double>::quiet_NaN());
  frame[0] = frame[1] = 0;
  frame[2] = height;
  completer.push(points, points);
  try {
    dynmesh::check_settings(dynmesh::Settings{.threads = 0});
  } catch (const dynmesh::SettingError&) {
    return frame[11];
  }
  return 0;
}
