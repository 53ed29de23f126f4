#include <algorithm>
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <fstream>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 3) return 2;  // budget TEMPLATE PARTIAL.raw
  const dynmesh::TemplateMesh body = dynmesh::read_template(argv[1]);
  for (const dynmesh::Method method : {dynmesh::Method::motion, dynmesh::Method::detail}) {
    dynmesh::Settings settings;
    settings.method = method;
    dynmesh::Completer<float> completer(body.triangles(), body.points(), settings);

    std::vector<float> frame(3 * completer.n_vertices());
    const dynmesh::Points<float> points(frame.data(), completer.n_vertices());
    const auto bytes = static_cast<std::streamsize>(frame.size() * sizeof(float));
    std::ifstream sensor(argv[2], std::ios::binary);
    double longest = 0;
    int frames = 0;
    int late = 0;
    while (sensor.read(reinterpret_cast<char*>(frame.data()), bytes)) {
      const double milliseconds = 1e3 * completer.push(points, points).seconds;
      longest = std::max(longest, milliseconds);
      frames += 1;
      late += milliseconds > 16 ? 1 : 0;
    }
    std::printf("%s: %d frames, longest %.1f ms, %d over 16 ms\n",
                method == dynmesh::Method::motion ? "motion" : "detail", frames, longest, late);
  }
}
