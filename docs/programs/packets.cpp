#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <stdexcept>
#include <vector>

struct Packet {
  int frame;                            // numbered by the sender
  std::vector<dynmesh::Index> indices;  // the vertices in it
  std::vector<float> positions;
};

// Takes one packet, or none by the deadline, and leaves in `shown` what is to be shown.
void step(dynmesh::Completer<float>& completer, const Packet* packet, int& last,
          dynmesh::Points<float> shown) {
  if (packet != nullptr && packet->frame <= last) return;  // late: the last frame stays
  if (packet != nullptr) {
    last = packet->frame;
    try {
      completer.push_sparse(packet->indices, {packet->positions.data(), packet->indices.size()},
                            shown);
      return;
    } catch (const std::invalid_argument& error) {
      std::printf("frame %d refused: %s\n", packet->frame, error.what());
    }
  }
  completer.skip(shown);  // lost, or bad: nothing was observed
}

int main() {
  const std::vector<dynmesh::Index> faces = {0, 1, 2, 2, 1, 3};
  std::vector<float> frame = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  const dynmesh::Points<float> shown(frame.data(), 4);
  dynmesh::Completer<float> completer({faces.data(), 2}, shown);
  const std::vector<Packet> packets = {
      {1, {0}, {0, 0, 1}}, {3, {0}, {0, 0, 3}}, {2, {0}, {0, 0, 2}}, {4, {9}, {0, 0, 4}}};
  int last = 0;
  for (const Packet& packet : packets) step(completer, &packet, last, shown);
  step(completer, nullptr, last, shown);
  std::printf("vertex 3 is at height %g, disconnected for %d frames\n", frame[11],
              completer.age()[3]);
}
