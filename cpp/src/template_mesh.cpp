#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <dynmesh/template_mesh.hpp>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "silent_openmesh.hpp"

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
  std::size_t polygons = 0;

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
    for (std::size_t c = 2; c < corners.size(); ++c) {
      mesh.faces.insert(mesh.faces.end(),
                        {corners[0].idx(), corners[c - 1].idx(), corners[c].idx()});
    }
    return FaceHandle(static_cast<int>(polygons++));
  }

  [[nodiscard]] std::size_t n_vertices() const override { return mesh.vertices.size() / 3; }
  [[nodiscard]] std::size_t n_faces() const override { return polygons; }
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

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw std::runtime_error(path + ": " + why);
}

/// What a file says it holds, found without OpenMesh. Its readers drop a vertex of an OBJ that is
/// not a number; in text PLY and OFF they turn to zero what comes after one, or after a comment;
/// and they go on past the end: all without a word.
struct Declared {
  std::size_t vertices = 0;
  std::size_t faces = 0;
};

void check_number(const std::string& path, std::size_t line, const std::string& token) {
  char* end = nullptr;
  const double value = std::strtod(token.c_str(), &end);
  if (*end != '\0' || !std::isfinite(value)) {
    refuse(path, "line " + std::to_string(line) + " has '" + token +
                     "' where a finite number should be; a template must be complete");
  }
}

/// A reference to a vertex, counted from 1 as OBJ does, and where it stands.
struct Reference {
  long long vertex = 0;
  std::size_t line = 0;
};

/// The vertices of one face. OpenMesh drops repeated ones, and the face with them, without a word.
std::vector<Reference> obj_face(const std::string& path, std::size_t line,
                                std::istringstream& corners, std::size_t vertices_so_far) {
  std::vector<Reference> face;
  for (std::string corner; corners >> corner;) {
    char* end = nullptr;
    long long vertex = std::strtoll(corner.c_str(), &end, 10);
    if (vertex < 0) vertex += static_cast<long long>(vertices_so_far) + 1;
    const bool is_number = end != corner.c_str() && (*end == '\0' || *end == '/');
    if (!is_number || vertex < 1) {
      refuse(path, "line " + std::to_string(line) + " has '" + corner +
                       "' where a vertex should be, counted from 1");
    }
    const bool repeated =
        std::ranges::any_of(face, [&](const Reference& other) { return other.vertex == vertex; });
    if (repeated) {
      refuse(path, "line " + std::to_string(line) + " has a face with vertex " +
                       std::to_string(vertex) + " twice; take it out");
    }
    face.push_back({vertex, line});
  }
  if (face.size() < 3) {
    refuse(path, "line " + std::to_string(line) + " has a face of " + std::to_string(face.size()) +
                     " vertices");
  }
  return face;
}

Declared scan_obj(const std::string& path, std::istream& file) {
  Declared declared;
  Reference largest;
  std::size_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    std::istringstream tokens(line);
    std::string token;
    tokens >> token;
    if (token == "f") {
      ++declared.faces;
      for (const Reference& corner : obj_face(path, number, tokens, declared.vertices)) {
        if (corner.vertex > largest.vertex) largest = corner;
      }
    } else if (token == "v") {
      ++declared.vertices;
      for (int c = 0; c < 3; ++c) {
        if (!(tokens >> token)) {
          refuse(path,
                 "line " + std::to_string(number) + " has a vertex of less than 3 coordinates");
        }
        check_number(path, number, token);
      }
    }
  }
  if (largest.vertex > static_cast<long long>(declared.vertices)) {
    refuse(path, "line " + std::to_string(largest.line) + " refers to vertex " +
                     std::to_string(largest.vertex) + ", but there are " +
                     std::to_string(declared.vertices));
  }
  return declared;
}

Declared scan_ply(const std::string& path, std::istream& file) {
  Declared declared;
  bool is_text = false;
  std::size_t number = 0;
  std::string line;
  while (std::getline(file, line)) {
    ++number;
    std::istringstream tokens(line);
    std::string keyword;
    std::string what;
    tokens >> keyword >> what;
    if (keyword == "end_header") break;
    if (keyword == "format") is_text = what == "ascii";
    if (keyword == "element" && what == "vertex") tokens >> declared.vertices;
    if (keyword == "element" && what == "face") tokens >> declared.faces;
  }
  while (is_text && std::getline(file, line)) {
    ++number;
    std::istringstream tokens(line);
    for (std::string token; tokens >> token;) check_number(path, number, token);
  }
  return declared;
}

/// Also writes the file without its comments to `text`.
Declared scan_off(const std::string& path, std::istream& file, std::ostream& text) {
  std::size_t number = 0;
  std::vector<std::size_t> counts;
  for (std::string line; std::getline(file, line);) {
    ++number;
    line = line.substr(0, line.find('#'));
    std::istringstream tokens(line);
    for (std::string token; tokens >> token;) {
      if (token == "BINARY") refuse(path, "binary OFF is not read; write it as text, or as PLY");
      if (counts.empty() && token.ends_with("OFF")) continue;
      check_number(path, number, token);
      if (counts.size() < 2) counts.push_back(std::strtoull(token.c_str(), nullptr, 10));
    }
    text << line << '\n';
  }
  if (counts.size() < 2) refuse(path, "ends before its numbers of vertices and faces");
  return {counts[0], counts[1]};
}

std::string lowercase_suffix(const std::string& path) {
  std::string suffix = std::filesystem::path(path).extension().string();
  std::ranges::transform(suffix, suffix.begin(), [](unsigned char c) { return std::tolower(c); });
  return suffix;
}

}  // namespace

TemplateMesh read_template(const std::string& path) {
  const std::string suffix = lowercase_suffix(path);
  if (suffix != ".obj" && suffix != ".ply" && suffix != ".off") {
    refuse(path, "a template is read from .obj, .ply or .off");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) refuse(path, "cannot be opened");
  std::stringstream text;
  const Declared declared = suffix == ".obj"   ? scan_obj(path, file)
                            : suffix == ".ply" ? scan_ply(path, file)
                                               : scan_off(path, file, text);
  file.clear();
  file.seekg(0);
  std::istream& input = suffix == ".off" ? static_cast<std::istream&>(text) : file;

  Collector collector;
  OpenMesh::IO::Options options;
  {
    const SilentOpenMesh silent;
    if (!OpenMesh::IO::IOManager().read(input, suffix, collector, options)) {
      refuse(path, "OpenMesh's reader cannot make sense of it");
    }
  }
  // An OBJ is read to its end; in the others nothing is looked for where nothing is.
  const bool ran_out = suffix != ".obj" && input.fail();
  if (ran_out || collector.n_vertices() != declared.vertices ||
      collector.polygons != declared.faces) {
    refuse(path, "declares " + std::to_string(declared.vertices) + " vertices and " +
                     std::to_string(declared.faces) + " faces, but not all could be read");
  }
  if (declared.vertices == 0) refuse(path, "holds no vertices");
  return std::move(collector.mesh);
}

}  // namespace dynmesh
