#include <doctest/doctest.h>

#include <dynmesh/template_mesh.hpp>
#include <filesystem>
#include <fstream>

#include "captured_errors.hpp"
#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

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

std::string refusal(const std::string& name, const std::string& content) {
  const TemporaryFile file(name, content);
  return message_of([&] { read_template(file.path()); });
}

constexpr const char* triangle_ply =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

TEST_CASE("templates keep every vertex and face in order") {
  const std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.1F, 5, 5, 9, 9, 9};
  SUBCASE("OBJ with a polygon, non-manifold faces and other elements") {
    const TemporaryFile file("a.OBJ",
                             "# a comment\nv 0 0 0\nv 1 0 0 1\nv 0 1 0\nvn 0 0 1\nvt 0 0\n"
                             "v 0.1 5 5\nv 9 9 9\n"
                             "f 1 2 3\nf 1/1 2/1 4/1\nf 1//1 2//1 5//1\nf 1 2 3 4\nf -1 -2 -3\n");
    const TemplateMesh mesh = read_template(file.path());
    CHECK(mesh.vertices == vertices);
    CHECK(mesh.faces == std::vector<Index>{0, 1, 2, 0, 1, 3, 0, 1, 4, 0, 1, 2, 0, 2, 3, 4, 3, 2});
  }
  SUBCASE("OFF") {
    const TemporaryFile file(
        "a.off", "OFF\n5 2 0 # counts\n0 0 0\n1 0 0\n0 1 0\n0.1 5 5\n9 9 9\n3 0 1 2\n3 0 1 3\n");
    const TemplateMesh mesh = read_template(file.path());
    CHECK(mesh.vertices == vertices);
    CHECK(mesh.faces == std::vector<Index>{0, 1, 2, 0, 1, 3});
  }
  SUBCASE("PLY, as text and binary") {
    std::string binary = triangle_ply;
    binary.replace(binary.find("ascii"), 5, "binary_little_endian");
    const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    binary.append(reinterpret_cast<const char*>(corners), sizeof corners);
    const Index face[] = {0, 1, 2};
    binary.append(1, '\3').append(reinterpret_cast<const char*>(face), sizeof face);
    for (const std::string& content :
         {std::string(triangle_ply) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", binary}) {
      const TemporaryFile file("a.ply", content);
      const TemplateMesh mesh = read_template(file.path());
      CHECK(mesh.vertices == std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
      CHECK(mesh.faces == std::vector<Index>{0, 1, 2});
    }
  }
}

TEST_CASE("incomplete and invalid data is refused") {
  // What else the parsers of OBJ and PLY refuse is told by the tests of Python, which calls them.
  const auto refused = [](const std::string& name, const std::string& content, const char* why) {
    CAPTURE(content);
    const std::string said = refusal(name, content);
    CHECK(said != "");
    CHECK(said.find(why) != std::string::npos);
  };
  refused("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n",
          "vertex 1, counted from 0, has the coordinate nan; a template must be complete");
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  refused("twice.obj", corners + "f 1 1 2\n", "line 4: a face has vertex 1 twice");
  refused("two.obj", corners + "f 1 2\n", "line 4: a face has 2 corners");
  refused("zero.obj", corners + "f 0 1 2\n", "line 4: there is no vertex 0");
  refused("nan.off", "OFF\n3 1 0\n0 0 0\ninf 0 0\n0 1 0\n3 0 1 2\n",
          "vertex 1, counted from 0, has the coordinate inf");
  refused("cut.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "ends");
  refused("empty.off", "", "ends before");
  refused("long.obj", "v 0 0 0\nv 1 0 1e39\nv 0 1 0\nf 1 2 3\n", "has the coordinate 1e+39");
  for (const char* face :
       {"4294967290 0 1 2\n", "-3 0 1 2\n", "2 0 1\n", "3 0 1 9\n", "3 0 1 -1\n", "3.5 0 1 2\n"}) {
    refused("face.off", std::string("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n") + face, "");
  }
}

TEST_CASE("an OFF with colours is read") {
  const TemporaryFile file(
      "colours.off", "COFF 3 1 0\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1 0 1 1 1 1\n3 0 1 2 255 0 0\n");
  const TemplateMesh mesh = read_template(file.path());
  CHECK(mesh.vertices == std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
  CHECK(mesh.faces == std::vector<Index>{0, 1, 2});
}

}  // namespace
}  // namespace dynmesh::testing
