#include <doctest/doctest.h>

#include <bit>
#include <cstring>
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

TEST_CASE("text preserves single precision") {
  std::vector<float> vertices;
  std::string text;
  for (std::uint32_t i = 0; i < 300; ++i) {
    const auto value = std::bit_cast<float>(0x3f000000U + i * 7919U);
    vertices.push_back(value);
    char number[32];
    std::snprintf(number, sizeof number, "%s%.9g", i % 3 == 0 ? "\nv " : " ", value);
    text += number;
  }
  const TemporaryFile file("precise.obj", text + "\nf 1 2 3\n");
  CHECK(read_template(file.path()).vertices == vertices);
}

TEST_CASE("incomplete and invalid data is refused") {
  CHECK(
      refusal("nan.obj", "v 0 0 0\nv nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
          .find("vertex 1, counted from 0, has the coordinate nan; a template must be complete") !=
      std::string::npos);
  CHECK(refusal("short.obj", "v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n").find("line 2") !=
        std::string::npos);
  CHECK(refusal("twice.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 1 2\n")
            .ends_with("line 5: a face has vertex 1 twice; remove the face"));
  CHECK(refusal("two.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n")
            .ends_with("line 4: a face has 2 corners, but needs 3"));
  CHECK(refusal("high.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
            .ends_with("line 4: there is no vertex 9, only 3"));
  CHECK(refusal("zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n")
            .find("line 4: there is no vertex 0") != std::string::npos);
  CHECK(refusal("text.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf a b c\n").find("line 4: 'a'") !=
        std::string::npos);
  CHECK(refusal("word.obj", "v 0 0 0\nv 1 0 x\nv 0 1 0\nf 1 2 3\n").find("'x'") !=
        std::string::npos);
  CHECK(refusal("nan.ply", std::string(triangle_ply) + "0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n")
            .find("vertex 1, counted from 0, has the coordinate nan") != std::string::npos);
  CHECK(refusal("nan.off", "OFF\n3 1 0\n0 0 0\ninf 0 0\n0 1 0\n3 0 1 2\n")
            .find("vertex 1, counted from 0, has the coordinate inf") != std::string::npos);
  CHECK(refusal("cut.ply", std::string(triangle_ply) + "0 0 0\n1 0 0\n0 1 0\n") != "");
  CHECK(refusal("cut.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n") != "");
  CHECK(refusal("empty.obj", "") != "");
  CHECK(refusal("empty.off", "").find("ends before") != std::string::npos);
  CHECK(refusal("empty.ply", "") != "");
  CHECK(refusal("long.obj", "v 0 0 0\nv 1 0 1e39\nv 0 1 0\nf 1 2 3\n")
            .find("vertex 1, counted from 0, has the coordinate 1e+39") != std::string::npos);
  CHECK(refusal("hexadecimal.obj", "v 0 0 0\nv 1 0 0x10\nv 0 1 0\nf 1 2 3\n").find("'0x10'") !=
        std::string::npos);
}

std::string binary_ply(const std::string& x_type, const std::string& count_type,
                       const std::string& body) {
  return "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty " + x_type +
         " x\nproperty float y\nproperty float z\nelement face 1\nproperty list " + count_type +
         " int vertex_indices\nend_header\n" + body;
}

TEST_CASE("malformed headers and counts are refused") {
  const std::string header = "ply\nformat ascii 1.0\n";
  CHECK(refusal("head.ply", header + "element vertex 3\nproperty float x\n")
            .ends_with("it has no line 'end_header'"));
  CHECK(refusal("order.ply", header + "property float x\nelement vertex 3\nend_header\n")
            .ends_with("line 3: 'property float x' is not valid here"));
  CHECK(refusal("bare.ply", header + "element vertex 9999999999\nend_header\n") != "");
  CHECK(refusal("bare.ply", header + "element q 99999999999999\nend_header\n").find("'q'") !=
        std::string::npos);
  for (const char* face :
       {"4294967290 0 1 2\n", "-3 0 1 2\n", "2 0 1\n", "3 0 1 9\n", "3 0 1 -1\n", "3.5 0 1 2\n"}) {
    CAPTURE(face);
    CHECK(refusal("face.ply", std::string(triangle_ply) + "0 0 0\n1 0 0\n0 1 0\n" + face) != "");
    CHECK(refusal("face.off", std::string("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n") + face) != "");
  }
  const std::string zeros(36, '\0');
  CHECK(refusal("face.ply", binary_ply("float", "int", zeros + "\xff\xff\xff\x7f")) != "");
  CHECK(refusal("face.ply", binary_ply("float", "int", zeros + "\xff\xff\xff\xff")) != "");
  const std::string face = '\3' + std::string(12, '\0');
  std::string far(48, '\0');
  const double coordinate = -1e300;
  std::memcpy(&far[32], &coordinate, sizeof coordinate);
  CHECK(refusal("far.ply", binary_ply("double", "uchar", far + face))
            .find("vertex 2, counted from 0, has the coordinate -1e+300") != std::string::npos);
  // OpenMesh would read zeros and print a message to standard error.
  CHECK(refusal("int.ply", binary_ply("int", "uchar", zeros + face))
            .find("must be float or double") != std::string::npos);
}

TEST_CASE("unusual files are read correctly") {
  const std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  SUBCASE("lists among the vertices and the faces of a PLY, and other elements") {
    const TemporaryFile file(
        "lists.ply",
        "ply\nformat ascii 1.0\ncomment by hand\nelement camera 1\nproperty list uint float view\n"
        "element vertex 3\nproperty float x\nproperty list uchar float weights\nproperty float y\n"
        "property float z\nelement face 1\nproperty uchar red\n"
        "property list ushort uint vertex_index\nproperty list uchar float texcoord\nend_header\n"
        "3 7 8 9\n0 2 5 5 0 0\n1 0 0 0\n0 1 5 1 0\n255 3 0 1 2 6 0 0 1 0 1 1\n");
    const TemplateMesh mesh = read_template(file.path());
    CHECK(mesh.vertices == vertices);
    CHECK(mesh.faces == std::vector<Index>{0, 1, 2});
  }
  SUBCASE("big-endian numbers, with counts of 32 bits") {
    std::string body;
    const auto append = [&](std::uint32_t value) {
      for (int shift = 24; shift >= 0; shift -= 8) body += static_cast<char>(value >> shift);
    };
    for (const float x : vertices) append(std::bit_cast<std::uint32_t>(x));
    for (const std::uint32_t number : {3, 0, 1, 2}) append(number);
    std::string content = binary_ply("float", "uint", body);
    content.replace(content.find("little"), 6, "big");
    const TemporaryFile file("big.ply", content);
    const TemplateMesh mesh = read_template(file.path());
    CHECK(mesh.vertices == vertices);
    CHECK(mesh.faces == std::vector<Index>{0, 1, 2});
  }
  SUBCASE("an OBJ with a material, a texture coordinate of one number, and a large polygon") {
    std::string content = "mtllib no-such-file\nvt 0.5\nusemtl red\n";
    std::string face = "f";
    for (int v = 1; v <= 20000; ++v) {
      content.append("v ").append(std::to_string(v)).append(" 0 0\n");
      face.append(" ").append(std::to_string(v)).append("/1");
    }
    const TemporaryFile file("material.obj", content + face + " # comment\n");
    CHECK(read_template(file.path()).triangles().count == 19998);
  }
  SUBCASE("an OFF with colours") {
    const TemporaryFile file("colours.off",
                             "COFF 3 1 0\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1 0 1 1 1 1\n"
                             "3 0 1 2 255 0 0\n");
    const TemplateMesh mesh = read_template(file.path());
    CHECK(mesh.vertices == vertices);
    CHECK(mesh.faces == std::vector<Index>{0, 1, 2});
  }
}

}  // namespace
}  // namespace dynmesh::testing
