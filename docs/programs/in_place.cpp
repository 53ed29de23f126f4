#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <vector>

struct Vertex {
  float position[3];
  float normal[3] = {};
  std::uint8_t seen[4] = {};
};

int main() {
  const std::vector<dynmesh::Index> faces = {0, 1, 2, 2, 1, 3};
  std::vector<Vertex> buffer = {{{0, 0, 0}}, {{1, 0, 0}}, {{0, 1, 0}}, {{1, 1, 0}}};
  constexpr std::ptrdiff_t stride = sizeof(Vertex) / sizeof(float);  // in elements
  const dynmesh::Points<float> points(buffer[0].position, buffer.size(), stride);
  const dynmesh::KnownMask known(buffer[0].seen, buffer.size(), sizeof(Vertex));

  dynmesh::Completer<float> completer({faces.data(), 2}, points);  // frame 0 is whole
  buffer[3] = {{1, 1, 5}, {}, {1}};                                // one vertex seen, 5 higher
  const dynmesh::FrameReport report = completer.push(points, known, points);
  std::printf("%zu filled in; vertex 0 is at height %g\n", report.filled, buffer[0].position[2]);
}
