/// Faces that a half-edge mesh cannot represent, and templates from files.
#include <doctest/doctest.h>

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <algorithm>
#include <atomic>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/topology.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <thread>
#include <utility>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

/// Captures the output to std::cerr, to which the stream of OpenMesh writes, during its lifetime.
class CapturedErrors {
 public:
  CapturedErrors() : usual_(std::cerr.rdbuf(text_.rdbuf())) {}
  ~CapturedErrors() { std::cerr.rdbuf(usual_); }
  CapturedErrors(const CapturedErrors&) = delete;
  CapturedErrors& operator=(const CapturedErrors&) = delete;
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::streambuf* usual_;
};

std::set<std::pair<Index, Index>> edges_of(const Cells& cells) {
  std::set<std::pair<Index, Index>> edges;
  for (std::size_t v = 0; v < cells.size(); ++v) {
    for (const Index n : cells[static_cast<Index>(v)]) edges.emplace(static_cast<Index>(v), n);
  }
  return edges;
}

std::set<std::pair<Index, Index>> edges_of(const std::vector<Index>& faces) {
  std::set<std::pair<Index, Index>> edges;
  for (std::size_t f = 0; f < faces.size(); f += 3) {
    for (std::size_t c = 0; c < 3; ++c) {
      const Index a = faces[f + c];
      const Index b = faces[f + (c + 1) % 3];
      if (a == b) continue;
      edges.emplace(a, b);
      edges.emplace(b, a);
    }
  }
  return edges;
}

TEST_CASE("faces that a half-edge mesh cannot represent are reported, and their edges kept") {
  struct Kind {
    Refusal kind;
    std::vector<Index> faces;
    std::vector<std::size_t> refused;
    std::string reason;
  };
  const std::vector<Kind> kinds = {
      {Refusal::degenerate, {0, 1, 2, 3, 3, 2, 4, 4, 4}, {1, 2}, "degenerate: vertices 3, 3, 2"},
      {Refusal::duplicate, {0, 1, 2, 2, 1, 3, 1, 2, 0, 1, 0, 2}, {2, 3}, "duplicate of face 0"},
      {Refusal::non_manifold_edge,
       {0, 1, 2, 1, 0, 3, 0, 1, 4},
       {2},
       "edge (0, 1) already has two faces: non-manifold"},
      {Refusal::flipped, {0, 1, 2, 0, 1, 3}, {1}, "flipped"},
      {Refusal::non_manifold_vertex,
       {0, 1, 2, 0, 2, 3, 0, 3, 1, 0, 4, 5},
       {3},
       "vertex 0 is already enclosed by faces: non-manifold"},
  };
  for (const Kind& expected : kinds) {
    CAPTURE(expected.reason);
    const Topology topology = build_topology(faces_of(expected.faces), 6);
    const auto& refused = topology.report.refused_faces;
    REQUIRE(refused.size() == expected.refused.size());
    for (std::size_t i = 0; i < refused.size(); ++i) {
      CHECK(refused[i].index == expected.refused[i]);
      CHECK(refused[i].kind == expected.kind);
    }
    CHECK(refused[0].reason.find(expected.reason) != std::string::npos);
    CHECK(edges_of(topology.cells) == edges_of(expected.faces));
  }
}

TEST_CASE("the refused faces are those that OpenMesh refuses, and nothing is printed") {
  int unorderable = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    // Random faces, among which all kinds of invalid faces occur.
    std::mt19937 random(seed);
    const int k = std::uniform_int_distribution(1, 12)(random);
    std::uniform_int_distribution<Index> vertex(0, k - 1);
    std::vector<Index> faces(3 * std::uniform_int_distribution<std::size_t>(1, 40)(random));
    for (auto& v : faces) v = vertex(random);
    std::vector<std::size_t> refused;
    {
      const CapturedErrors captured;
      const auto report = build_topology(faces_of(faces), static_cast<std::size_t>(k)).report;
      CHECK(captured.text() == "");
      for (const auto& face : report.refused_faces) {
        if (face.kind == Refusal::degenerate || face.kind == Refusal::duplicate) continue;
        refused.push_back(face.index);
        if (face.kind == Refusal::non_manifold_vertex) ++unorderable;
      }
    }
    const CapturedErrors captured;
    OpenMesh::TriConnectivity mesh;
    for (int v = 0; v < k; ++v) mesh.new_vertex();
    std::vector<std::size_t> expected;
    std::set<std::set<Index>> seen;
    for (std::size_t f = 0; f < faces.size() / 3; ++f) {
      const std::set<Index> corners(&faces[3 * f], &faces[3 * f] + 3);
      if (corners.size() < 3 || !seen.insert(corners).second) continue;
      const auto handle = mesh.add_face(OpenMesh::VertexHandle(faces[3 * f]),
                                        OpenMesh::VertexHandle(faces[3 * f + 1]),
                                        OpenMesh::VertexHandle(faces[3 * f + 2]));
      if (!handle.is_valid()) expected.push_back(f);
    }
    CHECK(refused == expected);
  }
  CHECK(unorderable > 0);
}

TEST_CASE("the output of the application is not lost while several threads build meshes") {
  const std::vector<Index> faces = {0, 1, 2, 1, 0, 3, 0, 1, 4};  // the last one is refused
  const CapturedErrors captured;
  std::atomic<bool> is_over{false};
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&] {
      while (!is_over) {
        if (build_topology(faces_of(faces), 5).report.refused_faces.size() != 1) ++wrong;
      }
    });
  }
  std::string expected;
  for (int line = 0; line < 2000; ++line) {
    const std::string text = "line " + std::to_string(line) + " of the host\n";
    (line % 2 == 0 ? omerr() : std::cerr) << text;
    expected += text;
    if (line % 20 == 0) std::this_thread::yield();
  }
  is_over = true;
  for (auto& thread : threads) thread.join();
  CHECK(captured.text() == expected);
  CHECK(wrong == 0);
}

/// A file that is deleted after the test. OpenMesh must print nothing about it.
class TemporaryFile {
 public:
  TemporaryFile(const std::string& name, const std::string& content)
      : path_((std::filesystem::temp_directory_path() / ("dynmesh-test-" + name)).string()) {
    std::ofstream(path_, std::ios::binary) << content;
  }
  ~TemporaryFile() {
    std::filesystem::remove(path_);
    CHECK(captured_.text() == "");
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  CapturedErrors captured_;
};

TEST_CASE("templates keep every vertex and face in order") {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  struct Case {
    std::string name, content;
    std::size_t n_vertices;
    std::vector<Index> faces;
  };
  const std::vector<Case> cases = {
      // With a polygon, non-manifold faces and other elements.
      {"a.OBJ",
       "# a comment\nv 0 0 0\nv 1 0 0 1\nv 0 1 0\nvn 0 0 1\nvt 0 0\nv 0.1 5 5\nv 9 9 9\n"
       "f 1 2 3\nf 1/1 2/1 4/1\nf 1//1 2//1 5//1\nf 1 2 3 4\nf -1 -2 -3\n",
       5,
       {0, 1, 2, 0, 1, 3, 0, 1, 4, 0, 1, 2, 0, 2, 3, 4, 3, 2}},
      {"a.ply", ply, 3, {0, 1, 2}},
  };
  const std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.1F, 5, 5, 9, 9, 9};
  for (const Case& one : cases) {
    CAPTURE(one.name);
    const TemporaryFile file(one.name, one.content);
    const TemplateMesh mesh = read_template(file.path());
    REQUIRE(mesh.vertices.size() == 3 * one.n_vertices);
    CHECK(std::ranges::equal(mesh.vertices, std::span(vertices).first(mesh.vertices.size())));
    CHECK(mesh.faces == one.faces);
  }
}

TEST_CASE("incomplete and invalid data is refused") {
  // What else the parsers of OBJ and PLY refuse is told by the tests of Python, which calls them.
  const auto refused = [](const std::string& name, const std::string& content, const char* why) {
    CAPTURE(content);
    const TemporaryFile file(name, content);
    const std::string said = message_of([&] { read_template(file.path()); });
    CHECK(said != "");
    CHECK(said.find(why) != std::string::npos);
  };
  refused("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n",
          "vertex 1, counted from 0, has the coordinate nan; a template must be complete");
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  refused("two.obj", corners + "f 1 2\n", "line 4: a face has 2 corners");
  refused("zero.obj", corners + "f 0 1 2\n", "line 4: there is no vertex 0");
  refused("long.obj", "v 0 0 0\nv 1 0 1e39\nv 0 1 0\nf 1 2 3\n", "has the coordinate 1e+39");
  const TemporaryFile beyond("beyond.obj", "v 0 0 0\nv 1 nan -1e39\n");
  CHECK(message_of([&] {
          read_positions(beyond.path());
        }).find("vertex 1, counted from 0, has the coordinate -1e+39") != std::string::npos);
  const TemporaryFile holes("holes.obj", "v 0 0 0\nv nan inf 3\n");
  CHECK(std::ranges::count_if(read_positions(holes.path()),
                              [](float x) { return std::isfinite(x); }) == 4);
}

}  // namespace
}  // namespace dynmesh::testing
