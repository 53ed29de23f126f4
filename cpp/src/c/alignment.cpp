/// The alignment of a template with a scan in the C interface.
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <dynmesh/alignment.hpp>

#include "c/arguments.hpp"
#include "c/status.hpp"

namespace dynmesh {
namespace {

dynmesh_alignment to_c(const Alignment& found) {
  dynmesh_alignment alignment = {{},
                                 {},
                                 found.mean_edge,
                                 found.before,
                                 found.after,
                                 found.ratio,
                                 found.lies_in_scan ? 1 : 0,
                                 found.matches ? 1 : 0,
                                 found.other_unit ? 1 : 0};
  std::ranges::copy(found.rotation, alignment.rotation);
  std::ranges::copy(found.shift, alignment.shift);
  return alignment;
}

}  // namespace
}  // namespace dynmesh

using namespace dynmesh;

dynmesh_status dynmesh_find_alignment(const int32_t* faces, int64_t n_faces,
                                      const dynmesh_points* first_frame, const dynmesh_points* scan,
                                      dynmesh_alignment* alignment) {
  return guarded([&] {
    check_pointer("alignment", alignment);
    with_type_of("first_frame", first_frame, [&]<class Real>(Points<const Real> frame) {
      const auto points = points_of<const Real>("scan", scan);
      *alignment = to_c(find_alignment(faces_of(faces, n_faces), frame, points));
    });
  });
}
