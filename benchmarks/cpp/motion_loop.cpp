/// Method motion beside a plain loop over equations (3) and (4) of the paper in single precision,
/// frame by frame in turns, one thread. Prints the median milliseconds of a frame, their ratio, and
/// how far the results are apart, in mean edges. `dynmesh-motion-loop [TEMPLATE]`: an OBJ or PLY
/// file; a torus of 10 000 vertices without.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <dynmesh/completer.hpp>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/topology.hpp>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "base/geometry.hpp"
#include "meshes.hpp"

namespace dynmesh {
namespace {

using Numbers = std::vector<float>;  // x, y, z of each vertex
using Four [[gnu::vector_size(16)]] = float;

/// What the method takes without checks of its arguments, reports, states, strides and threads.
class PlainLoop {
 public:
  PlainLoop(const Cells& cells, const Numbers& first)
      : cells_(cells), last_(cells.size()), d_(cells.size()), s_(cells.neighbours.size()) {
    for (std::size_t v = 0; v < last_.size(); ++v) last_[v] = row(first, v, 0);
    next_ = d_;
    generation_.resize(last_.size());
  }

  void push(const Numbers& points, Numbers& completed) {
    missing_.clear();
    for (std::size_t v = 0; v < last_.size(); ++v) {
      const Four given = row(points, v, 1);
      const Four nothing = given - given;  // NaN where a number is not finite
      const bool is_known = nothing[0] == 0 && nothing[1] == 0 && nothing[2] == 0;
      d_[v] = is_known ? given - last_[v] : Four{};
      next_[v] = d_[v];
      generation_[v] = is_known ? 0 : -1;
      if (!is_known) missing_.push_back(static_cast<Index>(v));
    }
    float* s = s_.data();
    const Four* const last = last_.data();
    for (const Index j : missing_) {
      for (const Index i : cells_[j]) {
        const Four edge = last[i] - last[j];
        const Four squares = edge * edge;
        *s++ = 1 / std::max(squares[0] + squares[1] + squares[2], 1e-20F);
      }
    }
    int reached = 1;
    for (int t = 1; reached > 0; ++t) reached = iterate(t);
    for (const Index j : missing_) {
      if (generation_[j] > 0) d_[j] *= 1 / d_[j][3];
    }
    for (std::size_t v = 0; v < last_.size(); ++v) {
      Four moved = d_[v];
      moved[3] = 0;
      last_[v] += moved;  // (3)
      for (std::size_t c = 0; c < 3; ++c) completed[3 * v + c] = last_[v][c];
    }
  }

 private:
  static Four row(const Numbers& of, std::size_t v, float last) {
    return Four{of[3 * v], of[3 * v + 1], of[3 * v + 2], last};
  }

  /// Returns how many satellites it reached. With none, it changes nothing.
  int iterate(int t) {
    const auto after = static_cast<float>(t + 1);
    int reached = 0;
    const float* s = s_.data();
    const Four* const d = d_.data();
    Four* const next = next_.data();
    for (const Index j : missing_) {
      Four sum = {};
      for (const Index i : cells_[j]) sum += *s++ * d[i];  // (4)
      if (!(sum[3] > 0)) continue;
      if (generation_[j] < 0) {
        generation_[j] = t;
        ++reached;
      }
      next[j] = (after - static_cast<float>(generation_[j])) / (after * sum[3]) * sum;
    }
    if (reached > 0) std::swap(d_, next_);
    return reached;
  }

  const Cells& cells_;
  std::vector<Four> last_, d_, next_;
  std::vector<float> s_;
  std::vector<int> generation_;
  std::vector<Index> missing_;
};

/// A frame of a body that waves.
Numbers frame_of(Points<const float> first, int number) {
  Numbers frame;
  for (std::size_t v = 0; v < first.count; ++v) {
    const double phase = 0.1 * number + 2 * first(v, 0);
    for (std::size_t c = 0; c < 3; ++c) {
      const double moved = first(v, c) + 0.05 * std::sin(phase + static_cast<double>(c));
      frame.push_back(static_cast<float>(moved));
    }
  }
  return frame;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <class Work>
double milliseconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  const auto end = std::chrono::steady_clock::now();
  return std::chrono::duration<double, std::milli>(end - start).count();
}

/// Compares frames of which a share is known at random, or for 0, those with x > 0.
void compare(const char* label, float share, Faces faces, Points<const float> first) {
  const Topology topology = build_topology(faces, first.count);
  const Numbers start = frame_of(first, 0);
  Settings settings;
  settings.method = Method::motion;
  Completer<float> completer(faces, {start.data(), first.count}, settings);
  PlainLoop loop(topology.cells, start);
  std::mt19937 random(5);
  std::bernoulli_distribution is_drawn(share);
  std::vector<double> times, plain_times;
  Numbers completed(start), plain(start);
  double apart = 0;
  for (int t = 1; t <= 400; ++t) {
    Numbers given = frame_of(first, t);
    for (std::size_t v = 0; v < first.count; ++v) {
      if (share > 0 ? is_drawn(random) : first(v, 0) > 0) continue;
      std::fill_n(&given[3 * v], 3, std::numeric_limits<float>::quiet_NaN());
    }
    const auto of_library = [&] {
      (void)completer.push({given.data(), first.count}, {completed.data(), first.count});
    };
    const auto of_loop = [&] { loop.push(given, plain); };
    if (t % 2 == 0) times.push_back(milliseconds(of_library));
    plain_times.push_back(milliseconds(of_loop));
    if (t % 2 == 1) times.push_back(milliseconds(of_library));
    for (std::size_t i = 0; i < plain.size(); ++i) {
      apart = std::max(apart, std::abs(double{completed[i]} - double{plain[i]}));
    }
  }
  const double a = median(times), b = median(plain_times);
  std::printf("| %-8s | %.3f | %.3f | %.2f | %.0e |\n", label, a, b, a / b,
              apart / mean_edge_length(topology.cells, testing::rows_of(start)));
}

}  // namespace
}  // namespace dynmesh

int main(int n_arguments, char** arguments) {
  using dynmesh::testing::torus;
  dynmesh::TemplateMesh mesh;
  if (n_arguments > 1) {
    mesh = dynmesh::read_template(arguments[1]);
  } else {
    const auto given = torus(100);
    for (const double x : given.vertices) mesh.vertices.push_back(static_cast<float>(x));
    mesh.faces = given.indices;
  }
  std::printf("| known | dynmesh | plain loop | ratio | apart |\n|---|---|---|---|---|\n");
  using Case = std::pair<const char*, float>;
  for (const auto& [label, share] : {Case("10 %", 0.1F), Case("30 %", 0.3F), Case("50 %", 0.5F),
                                     Case("70 %", 0.7F), Case("x > 0", 0.0F)}) {
    dynmesh::compare(label, share, mesh.triangles(), mesh.points());
  }
}
