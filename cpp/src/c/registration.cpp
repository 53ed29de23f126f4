/// Registration in the C interface.
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstdint>
#include <dynmesh/registration.hpp>
#include <vector>

#include "c/arguments.hpp"
#include "c/depth_images.hpp"
#include "c/handles.hpp"
#include "c/status.hpp"

namespace dynmesh {
namespace {

constexpr const char* reference = "the template";

template <class Real>
Registration<Real> registered(const dynmesh_registration_request& request, bool uncertainty,
                              const Training<Real>* training) {
  const auto optional = [](const char* argument, const dynmesh_points* view) {
    return view == nullptr ? Points<const Real>{}
                           : points_of<const Real>(argument, view, reference);
  };
  const auto positions = points_of<const Real>("template", request.positions, reference);
  Landmarks<Real> landmarks;
  landmarks.positions = optional("landmarks", request.landmarks);
  if (landmarks.positions.count > 0) {
    check_pointer("landmark_vertices", request.landmark_vertices);
    landmarks.vertices = {request.landmark_vertices, landmarks.positions.count};
  }
  const RegistrationSettings settings = {request.align != 0, request.scale != 0, uncertainty,
                                         request.threads};
  const Faces faces = faces_of(request.faces, request.n_faces);
  if (request.points == nullptr && request.images != nullptr) {
    const auto images = images_of(request.images, request.n_images);
    return register_template<Real>(faces, positions, images, landmarks, settings, training);
  }
  const Scan<Real> scan = {points_of<const Real>("points", request.points, reference),
                           optional("normals", request.normals),
                           optional("viewpoints", request.viewpoints)};
  return register_template<Real>(faces, positions, scan, landmarks, settings, training);
}

template <class Real>
void store(const Registration<Real>& found, const dynmesh_output* vertices, std::uint8_t* observed,
           double* standard_error, dynmesh_registration_report* report) {
  const auto out = points_of<Real>("vertices", vertices, reference);
  for (std::size_t v = 0; v < out.count; ++v) {
    for (std::size_t c = 0; c < 3; ++c) out(v, c) = found.vertices[3 * v + c];
  }
  if (observed != nullptr) std::ranges::copy(found.observed, observed);
  if (standard_error != nullptr) std::ranges::copy(found.standard_error, standard_error);
  if (report == nullptr) return;
  std::ranges::copy(found.transform, report->transform);
  report->far_share = found.far_share;
  report->hole = found.hole;
  report->overlap = found.overlap;
  report->distance = found.distance;
  report->rounds = static_cast<std::int64_t>(found.rounds);
  report->converged = found.converged ? 1 : 0;
  report->quality = static_cast<std::int32_t>(found.quality);
}

}  // namespace
}  // namespace dynmesh

using namespace dynmesh;

dynmesh_status dynmesh_register(const dynmesh_registration_request* request,
                                const dynmesh_output* vertices, uint8_t* observed,
                                double* standard_error, dynmesh_registration_report* report) {
  const auto run = [&]<class Real>(const Training<Real>* training) {
    const auto positions = points_of<const Real>("template", request->positions, reference);
    const auto out = points_of<Real>("vertices", vertices, reference);
    check_rows("vertices", out, positions.count);
    const bool uncertainty = standard_error != nullptr;
    store(registered<Real>(*request, uncertainty, training), vertices, observed, standard_error,
          report);
  };
  const dynmesh_status status = guarded([&] {
    check_pointer("request", request);
    check_pointer("vertices", vertices);
    if (request->training != nullptr) return;
    with_type_of("template", request->positions, [&]<class Real>(Points<const Real>) {
      run(static_cast<const Training<Real>*>(nullptr));
    });
  });
  if (status != DYNMESH_OK || request->training == nullptr) return status;
  return with(request->training, [&]<class Real>(const Training<Real>& frames) { run(&frames); });
}
