/// Rehearsals in the C interface.
#include <dynmesh/dynmesh.h>

#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <dynmesh/rehearsal.hpp>
#include <limits>
#include <string>

#include "c/arguments.hpp"
#include "c/handles.hpp"
#include "c/status.hpp"

using namespace dynmesh;  // C has no namespaces

dynmesh_status dynmesh_rehearsal_create(int64_t n_vertices, int32_t type,
                                        dynmesh_rehearsal** rehearsal) {
  return guarded([&] {
    check_pointer("rehearsal", rehearsal);
    *rehearsal = nullptr;
    if (n_vertices < 0 || n_vertices > std::numeric_limits<Index>::max()) {
      refuse("n_vertices", "must be from 0 to 2147483647, not " + std::to_string(n_vertices));
    }
    const auto k = static_cast<std::size_t>(n_vertices);
    switch (type) {
      case DYNMESH_FLOAT32:
        *rehearsal = new dynmesh_rehearsal{Rehearsal<float>(k)};
        break;
      case DYNMESH_FLOAT64:
        *rehearsal = new dynmesh_rehearsal{Rehearsal<double>(k)};
        break;
      default:
        refuse("type", std::string("must be ") + known_types + ", not " + std::to_string(type));
    }
  });
}

dynmesh_status dynmesh_rehearsal_add(dynmesh_rehearsal* rehearsal, const dynmesh_points* frame) {
  return with(rehearsal, [&]<class Real>(Rehearsal<Real>& frames) {
    frames.add(points_of<const Real>("frame", frame, "the rehearsal"));
  });
}

void dynmesh_rehearsal_destroy(dynmesh_rehearsal* rehearsal) { delete rehearsal; }

dynmesh_status dynmesh_create_rehearsed(const int32_t* faces, int64_t n_faces,
                                        const dynmesh_points* first_frame,
                                        const dynmesh_settings* settings,
                                        dynmesh_rehearsal* rehearsal,
                                        dynmesh_completer** completer) {
  const dynmesh_status status = guarded([&] {
    check_pointer("completer", completer);
    *completer = nullptr;
  });
  if (status != DYNMESH_OK) return status;
  return with(rehearsal, [&]<class Real>(const Rehearsal<Real>& frames) {
    const auto frame = points_of<const Real>("first_frame", first_frame, "the rehearsal");
    *completer = new dynmesh_completer{
        Completer<Real>(faces_of(faces, n_faces), frame, settings_of(settings), frames)};
  });
}
