// Uses Eigen, nanoflann and OpenMesh, completes and tracks a frame, and loads the plugins.
#include <dlfcn.h>

#include <Eigen/Sparse>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <cmath>
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <limits>
#include <nanoflann.hpp>
#include <vector>

using Vectors = Eigen::Matrix<double, Eigen::Dynamic, 3>;

constexpr int side = 12;

bool solves() {
  using Matrix = Eigen::SparseMatrix<double>;
  const int n = 100;
  Matrix matrix(n, n);
  for (int i = 0; i < n; ++i) {
    matrix.insert(i, i) = 3;
    if (i > 0) matrix.insert(i, i - 1) = -1;
  }
  const Eigen::SimplicialLLT<Matrix> factor(matrix);
  const Matrix whole = matrix.selfadjointView<Eigen::Lower>();
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(n);
  const Eigen::VectorXd solved = factor.solve(ones);
  return (whole * solved - ones).norm() < 1e-9;
}

bool finds_the_nearest() {
  const Vectors points = Vectors::Random(500, 3);
  const nanoflann::KDTreeEigenMatrixAdaptor<Vectors> tree(3, points);
  Eigen::Index found = -1;
  double squared = -1;
  const Eigen::Vector3d at = points.row(7);
  tree.query(at.data(), 1, &found, &squared);
  return found == 7 && squared == 0;
}

bool counts_neighbours() {
  OpenMesh::TriMesh_ArrayKernelT<> mesh;
  std::vector<OpenMesh::VertexHandle> v(4);
  for (auto& handle : v) handle = mesh.add_vertex({});
  mesh.add_face(v[0], v[1], v[2]);
  mesh.add_face(v[2], v[1], v[3]);
  int n = 0;
  for (auto i = mesh.vv_iter(v[1]); i.is_valid(); ++i) ++n;
  return n == 3;
}

template <class Real>
bool completes_and_tracks() {
  std::vector<Real> body;
  std::vector<dynmesh::Index> faces;
  for (int i = 0; i < side * side; ++i) {
    const int x = i % side;
    const int y = i / side;
    body.insert(body.end(), {Real(x), Real(y), Real(std::sin(0.5 * x) * std::cos(0.4 * y))});
    if (x + 1 < side && y + 1 < side) {
      faces.insert(faces.end(), {i, i + 1, i + side, i + side, i + 1, i + side + 1});
    }
  }
  const dynmesh::Faces triangles(faces.data(), faces.size() / 3);
  const dynmesh::Points<Real> points(body.data(), body.size() / 3);
  std::vector<Real> frame = body;
  const dynmesh::Points<Real> out(frame.data(), body.size() / 3);
  dynmesh::Completer<Real> completer(triangles, points);
  for (std::size_t i = 0; i < frame.size(); ++i) {
    frame[i] = i % 21 > 8 ? std::numeric_limits<Real>::quiet_NaN() : body[i] + 1;
  }
  completer.push(out, out);
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (!(std::abs(frame[i] - body[i] - 1) < Real(1e-4))) return false;
  }
  dynmesh::Tracker<Real> tracker(triangles, points);
  return tracker.push({.points = points}, out).known > side * side / 2;
}

bool loads(const char* path) {
  void* plugin = dlopen(path, RTLD_NOW | RTLD_GLOBAL);
  if (plugin == nullptr) return false;
  const auto height = reinterpret_cast<double (*)(double)>(dlsym(plugin, "height_of_last"));
  return std::abs(height(5) - 5) < 1e-9;
}

int main() {
  const bool results[] = {solves(),
                          finds_the_nearest(),
                          counts_neighbours(),
                          completes_and_tracks<float>(),
                          completes_and_tracks<double>(),
                          loads(first_plugin),
                          loads(second_plugin)};
  bool good = true;
  for (const bool result : results) {
    std::printf(result ? "works " : "FAILS ");
    good = good && result;
  }
  std::puts("");
  return good ? 0 : 1;
}
