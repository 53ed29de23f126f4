/// Training sequences in the C interface.
#include <dynmesh/dynmesh.h>

#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <dynmesh/training.hpp>
#include <limits>
#include <string>

#include "c/arguments.hpp"
#include "c/handles.hpp"
#include "c/status.hpp"

using namespace dynmesh;  // C has no namespaces

dynmesh_status dynmesh_training_create(int64_t n_vertices, int32_t type,
                                       dynmesh_training** training) {
  return guarded([&] {
    check_pointer("training", training);
    *training = nullptr;
    if (n_vertices < 0 || n_vertices > std::numeric_limits<Index>::max()) {
      refuse("n_vertices", "must be from 0 to 2147483647, not " + std::to_string(n_vertices));
    }
    const auto k = static_cast<std::size_t>(n_vertices);
    switch (type) {
      case DYNMESH_FLOAT32:
        *training = new dynmesh_training{Training<float>(k)};
        break;
      case DYNMESH_FLOAT64:
        *training = new dynmesh_training{Training<double>(k)};
        break;
      default:
        refuse("type", std::string("must be ") + known_types + ", not " + std::to_string(type));
    }
  });
}

dynmesh_status dynmesh_training_add(dynmesh_training* training, const dynmesh_points* frame) {
  return with(training, [&]<class Real>(Training<Real>& frames) {
    frames.add(points_of<const Real>("frame", frame, "the training sequence"));
  });
}

void dynmesh_training_destroy(dynmesh_training* training) { delete training; }

dynmesh_status dynmesh_create_trained(const int32_t* faces, int64_t n_faces,
                                      const dynmesh_points* first_frame,
                                      const dynmesh_settings* settings, dynmesh_training* training,
                                      dynmesh_completer** completer) {
  const dynmesh_status status = guarded([&] {
    check_pointer("completer", completer);
    *completer = nullptr;
  });
  if (status != DYNMESH_OK) return status;
  return with(training, [&]<class Real>(const Training<Real>& frames) {
    const auto frame = points_of<const Real>("first_frame", first_frame, "the training sequence");
    *completer = new dynmesh_completer{
        Completer<Real>(faces_of(faces, n_faces), frame, settings_of(settings), frames)};
  });
}
