#include <OpenMesh/Core/IO/IOManager.hh>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <dynmesh/template_mesh.hpp>
#include <filesystem>
#include <fstream>
#include <limits>
#include <mutex>
#include <sstream>
#include <string>
#include <utility>

#include "template_files.hpp"

namespace dynmesh {
namespace {

using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

/// Takes vertices and faces from OpenMesh's readers as they come. The usual importer would build
/// half-edges, and drop each face that these cannot hold.
class Collector final : public OpenMesh::IO::BaseImporter {
 public:
  TemplateMesh mesh;

  VertexHandle add_vertex(const OpenMesh::Vec3f& point) override {
    mesh.vertices.insert(mesh.vertices.end(), {point[0], point[1], point[2]});
    return VertexHandle(static_cast<int>(n_vertices()) - 1);
  }
  VertexHandle add_vertex() override {
    constexpr float missing = std::numeric_limits<float>::quiet_NaN();
    return add_vertex(OpenMesh::Vec3f(missing, missing, missing));
  }
  void set_point(VertexHandle vertex, const OpenMesh::Vec3f& point) override {
    for (std::size_t c = 0; c < 3; ++c) {
      mesh.vertices.at(3 * static_cast<std::size_t>(vertex.idx()) + c) = point[c];
    }
  }
  FaceHandle add_face(const VHandles& corners) override {
    for (const VertexHandle corner : corners) mesh.faces.push_back(corner.idx());
    return FaceHandle(static_cast<int>(n_faces()) - 1);
  }

  [[nodiscard]] std::size_t n_vertices() const override { return mesh.vertices.size() / 3; }
  [[nodiscard]] std::size_t n_faces() const override { return mesh.faces.size() / 3; }
  [[nodiscard]] std::size_t n_edges() const override { return 0; }

  // A completer has no use for the rest.
  HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
  FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec2f>&) override {}
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec3f>&) override {}
  void set_face_texindex(FaceHandle, int) override {}
  void set_halfedge(VertexHandle, HalfedgeHandle) override {}
  void set_normal(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(VertexHandle, const OpenMesh::Vec3d&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec4f&) override {}
  void set_texcoord(VertexHandle, const OpenMesh::Vec2f&) override {}
  void set_status(VertexHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_next(HalfedgeHandle, HalfedgeHandle) override {}
  void set_face(HalfedgeHandle, FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void set_texcoord(HalfedgeHandle, const OpenMesh::Vec2f&) override {}
  void set_texcoord(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_texcoord(HalfedgeHandle, const OpenMesh::Vec3f&) override {}
  void set_status(HalfedgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec3f&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec4f&) override {}
  void set_status(OpenMesh::EdgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_normal(FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(FaceHandle, const OpenMesh::Vec3d&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec4f&) override {}
  void set_status(FaceHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void add_texture_information(int, std::string) override {}
};

std::string lowercase_suffix(const std::string& path) {
  std::string suffix = std::filesystem::path(path).extension().string();
  std::ranges::transform(suffix, suffix.begin(), [](unsigned char c) { return std::tolower(c); });
  return suffix;
}

/// No format has a reader that looks at what it read.
void check(const std::string& path, const TemplateMesh& mesh) {
  const std::size_t k = mesh.points().count;
  const auto wrong =
      std::ranges::find_if_not(mesh.vertices, [](float x) { return std::isfinite(x); });
  if (wrong != mesh.vertices.end()) {
    const auto vertex = static_cast<std::size_t>(wrong - mesh.vertices.begin()) / 3;
    refuse_file(path, "vertex " + std::to_string(vertex) + ", counted from 0, is not finite; " +
                          "a template must be complete");
  }
  for (const Index corner : mesh.faces) {
    if (corner >= 0 && static_cast<std::size_t>(corner) < k) continue;
    refuse_file(path, "a face refers to vertex " + std::to_string(corner) + ", but there are " +
                          std::to_string(k) + ", counted from 0");
  }
}

/// OpenMesh has one reader for each format, which keeps notes while it reads: one thread at a time.
/// They print what they cannot make sense of, and so nothing about the plain files that they get.
std::mutex& openmesh_readers() {
  static std::mutex instance;
  return instance;
}

}  // namespace

TemplateMesh read_template(const std::string& path) {
  const std::string suffix = lowercase_suffix(path);
  if (suffix != ".obj" && suffix != ".ply" && suffix != ".off") {
    refuse_file(path, "a template is read from .obj, .ply or .off");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) refuse_file(path, "cannot be opened");
  PlainMesh plain = suffix == ".obj"   ? plain_obj(path, file)
                    : suffix == ".ply" ? plain_ply(path, file)
                                       : plain_off(path, file);
  if (plain.vertices == 0) refuse_file(path, "holds no vertices");
  if (std::max(plain.vertices, plain.triangles) > std::numeric_limits<Index>::max()) {
    refuse_file(path, "holds more than 2^31 - 1 vertices or triangles");
  }

  std::istringstream text(std::move(plain.text));
  Collector collector;
  OpenMesh::IO::Options options;
  {
    const std::lock_guard<std::mutex> turn(openmesh_readers());
    if (!OpenMesh::IO::IOManager().read(text, suffix, collector, options)) {
      refuse_file(path, "OpenMesh's reader cannot make sense of it");
    }
  }
  if (collector.n_vertices() != plain.vertices || collector.n_faces() != plain.triangles) {
    refuse_file(path, "OpenMesh's reader lost some of it");
  }
  check(path, collector.mesh);
  return std::move(collector.mesh);
}

}  // namespace dynmesh
