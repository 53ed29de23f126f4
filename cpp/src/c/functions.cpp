/// The functions of the C interface beside those of completers and trackers.
#include <dynmesh/dynmesh.h>

#include <array>
#include <cmath>
#include <cstring>
#include <dynmesh/alignment.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/whole_frame.hpp>
#include <utility>

#include "c/calls.hpp"

namespace dynmesh {
namespace {

using Message = std::array<char, 1024>;  // of fixed size, since reporting that memory is exhausted
                                         // must not allocate any

Message& last_message() noexcept {
  thread_local Message message{};
  return message;
}

/// The owner of the arrays to which a dynmesh_template points.
struct OwnedTemplate : dynmesh_template {
  explicit OwnedTemplate(TemplateMesh read) : dynmesh_template{}, mesh(std::move(read)) {
    vertices = mesh.vertices.data();
    n_vertices = static_cast<std::int64_t>(mesh.points().count);
    faces = mesh.faces.data();
    n_faces = static_cast<std::int64_t>(mesh.triangles().count);
  }
  TemplateMesh mesh;
};

/// Copies the positions of all vertices to the caller, and what else is wanted of each vertex.
template <class Real>
void give(const std::vector<Real>& found, Points<Real> positions,
          const std::vector<std::uint8_t>& flags, std::uint8_t* flags_out,
          const std::vector<Real>& standard_error, double* standard_error_out) {
  for (std::size_t v = 0; v < positions.count; ++v) {
    for (std::size_t c = 0; c < 3; ++c) positions(v, c) = found[3 * v + c];
  }
  if (flags_out != nullptr) std::ranges::copy(flags, flags_out);
  if (standard_error_out != nullptr) std::ranges::copy(standard_error, standard_error_out);
}

WholeFrameSettings settings_of(const dynmesh_whole_frame_request& request) {
  WholeFrameSettings settings;
  if (request.frame < -1) {
    refuse("frame", "must be -1 or the number of a frame, not " + std::to_string(request.frame));
  }
  if (request.frame >= 0) settings.frame = static_cast<std::size_t>(request.frame);
  if (!std::isnan(request.noise)) settings.noise = request.noise;
  settings.outliers = request.outliers != 0;
  settings.threads = request.threads;
  return settings;
}

template <class Real>
WholeFrame<Real> put_together(const dynmesh_whole_frame_request& request, Points<Real> positions) {
  check_view("positions", positions);
  const FrameSource<Real> source = [&](std::size_t frame, Points<Real> points,
                                       std::span<std::uint8_t> known) {
    const auto number = static_cast<std::int64_t>(frame);
    if (request.source(request.context, number, points.data, known.data()) != 0) {
      throw Stopped("frame " + std::to_string(frame) + ": stopped by the source");
    }
  };
  const Progress progress = [&](std::size_t done, std::size_t of) {
    if (request.progress == nullptr) return;
    if (request.progress(request.context, static_cast<std::int64_t>(done),
                         static_cast<std::int64_t>(of)) != 0) {
      throw Stopped("stopped after " + std::to_string(done) + " of " + std::to_string(of) +
                    " steps");
    }
  };
  return whole_frame<Real>(faces_of(request.faces, request.n_faces), positions.count,
                           count_of("n_frames", request.n_frames), source, settings_of(request),
                           progress);
}

template <class Real>
Registration<Real> registered(const dynmesh_registration_request& request,
                              Points<const Real> positions, bool uncertainty,
                              const Training<Real>* training) {
  const auto optional = [](const char* argument, const dynmesh_points* view) {
    return view == nullptr ? Points<const Real>{}
                           : points_of<const Real>(argument, view, "the template");
  };
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
  const Scan<Real> scan = {points_of<const Real>("points", request.points, "the template"),
                           optional("normals", request.normals),
                           optional("viewpoints", request.viewpoints)};
  return register_template<Real>(faces, positions, scan, landmarks, settings, training);
}

}  // namespace

dynmesh_status fail(dynmesh_status status, const char* message) noexcept {
  Message& kept = last_message();
  std::size_t size = std::strlen(message);
  if (size >= kept.size()) {
    const auto is_inside_character = [&](std::size_t i) { return (message[i] & 0xC0) == 0x80; };
    size = kept.size() - 1;
    for (int back = 0; back < 3 && is_inside_character(size); ++back) --size;
  }
  std::memmove(kept.data(), message, size);
  kept[size] = '\0';
  return status;
}

}  // namespace dynmesh

using namespace dynmesh;  // C has no namespaces

const char* dynmesh_last_message() { return last_message().data(); }

const char* dynmesh_version() { return DYNMESH_VERSION; }

dynmesh_status dynmesh_find_alignment(const int32_t* faces, int64_t n_faces,
                                      const dynmesh_points* first_frame, const dynmesh_points* scan,
                                      dynmesh_alignment* alignment) {
  return guarded([&] {
    check_pointer("alignment", alignment);
    with_type_of("first_frame", first_frame, [&]<class Real>(Points<const Real> frame) {
      const auto points = points_of<const Real>("scan", scan);
      *alignment = to_c<dynmesh_alignment>(find_alignment(faces_of(faces, n_faces), frame, points));
    });
  });
}

dynmesh_status dynmesh_whole_frame(const dynmesh_whole_frame_request* request,
                                   const dynmesh_output* positions, uint8_t* seen,
                                   double* standard_error, dynmesh_whole_frame_report* report) {
  return guarded([&] {
    check_pointer("request", request);
    if (request->source == nullptr) refuse("source", "is a null pointer");
    check_pointer("positions", positions);
    check_pointer("report", report);
    with_type("positions: type", positions->type, [&]<class Real>(Real) {
      const auto out = points_of<Real>("positions", positions, "all frames");
      const auto whole = put_together<Real>(*request, out);
      give(whole.positions, out, whole.seen, seen, whole.standard_error, standard_error);
      *report = {static_cast<std::int64_t>(whole.frame), whole.doubtful ? 1 : 0};
    });
  });
}

dynmesh_status dynmesh_register(const dynmesh_registration_request* request,
                                const dynmesh_output* vertices, uint8_t* observed,
                                double* standard_error, dynmesh_registration_report* report) {
  return guarded([&] {
    check_pointer("request", request);
    check_pointer("vertices", vertices);
    with_training(
        "template", request->positions, request->training,
        [&]<class Real>(Points<const Real> positions, const Training<Real>* training) {
          const auto out = points_of<Real>("vertices", vertices, "the template");
          check_rows("vertices", out, positions.count);
          const auto found = registered(*request, positions, standard_error != nullptr, training);
          give(found.vertices, out, found.observed, observed, found.standard_error, standard_error);
          if (report != nullptr) *report = to_c<dynmesh_registration_report>(found);
        });
  });
}

dynmesh_status dynmesh_read_template(const char* path, const dynmesh_template** mesh) {
  return guarded([&] {
    check_pointer("mesh", mesh);
    *mesh = nullptr;
    check_pointer("path", path);
    *mesh = new OwnedTemplate(read_template(path));
  });
}

void dynmesh_free_template(const dynmesh_template* mesh) {
  // Each of them was made as one. NOLINTNEXTLINE(cppcoreguidelines-pro-type-static-cast-downcast)
  delete static_cast<const OwnedTemplate*>(mesh);
}
