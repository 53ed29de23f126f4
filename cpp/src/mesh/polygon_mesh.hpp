/// What the parsers of OBJ, PLY and OFF files return.
///
/// The readers of OpenMesh are not used, since they do not validate files. They crash on a PLY file
/// whose header is out of order and do not return if the header is truncated. They allocate memory
/// for any count that a file declares. They open the material files that an OBJ file names. A list
/// property of the vertices of a PLY file shifts all data that follows it. Text that is not a
/// number becomes zero or is dropped without an error.
#pragma once

#include <cstdint>
#include <vector>

namespace dynmesh {

struct PolygonMesh {
  std::vector<double> positions;      ///< x y z of every vertex, in the order of the file
  std::vector<std::int64_t> sizes;    ///< the number of corners of each face, at least 3
  std::vector<std::int64_t> corners;  ///< the vertices of all corners, counted from 0
};

}  // namespace dynmesh
