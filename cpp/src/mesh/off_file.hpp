/// The parser of OFF files.
#pragma once

#include <string_view>

#include "mesh/polygon_mesh.hpp"

namespace dynmesh {

/// Parses the text of an OFF file or of a variant such as COFF, whose normals, colours and texture
/// coordinates are skipped. Positions may be NaN or infinite. Throws MalformedFile if the text is
/// invalid. Takes linear time, and memory of a small multiple of the size of the text.
PolygonMesh parse_off(std::string_view text);

}  // namespace dynmesh
