#include "mesh/obj_file.hpp"

#include <doctest/doctest.h>

namespace dynmesh::testing {
namespace {

TEST_CASE("comments at the beginning of an OBJ file and the statements of its faces are kept") {
  const std::string_view text =
      "# up_axis z\n\n  #by hand\nmtllib a.mtl # colours\nv 0 0 0 1 0 0\r\nv 1 0 0\rvt 0 1\n"
      "v 0 1 \\\n 0\n# later\nusemtl red\nf 1/1 2/1 3/1";
  const ObjFile file = parse_obj(text);
  using Texts = std::vector<std::string_view>;
  CHECK(file.comments == Texts{" up_axis z", "by hand"});
  CHECK(file.faces == Texts{"f 1/1 2/1 3/1"});
  CHECK(file.mesh.positions == std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0});
  CHECK(file.mesh.corners == std::vector<std::int64_t>{0, 1, 2});
}

}  // namespace
}  // namespace dynmesh::testing
