/// Whole frames in the C interface.
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/whole_frame.hpp>
#include <span>
#include <string>

#include "c/arguments.hpp"
#include "c/status.hpp"

namespace dynmesh {
namespace {

WholeFrameSettings settings_of(const dynmesh_whole_frame_request& request) {
  WholeFrameSettings settings;
  if (request.frame < -1) {
    refuse("frame", "must be -1 or the number of a frame, not " + std::to_string(request.frame));
  }
  if (request.frame >= 0) settings.frame = static_cast<std::size_t>(request.frame);
  settings.noise = setting_from_c<std::optional<double>>("noise", request.noise);
  settings.outliers = request.outliers != 0;
  settings.threads = request.threads;
  return settings;
}

template <class Real>
void put_together(const dynmesh_whole_frame_request& request, const dynmesh_output* output,
                  std::uint8_t* seen, double* standard_error, dynmesh_whole_frame_report* report) {
  const auto positions = points_of<Real>("positions", output, "all frames");
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
  const WholeFrame<Real> whole = whole_frame<Real>(
      faces_of(request.faces, request.n_faces), positions.count,
      count_of("n_frames", request.n_frames), source, settings_of(request), progress);
  for (std::size_t v = 0; v < positions.count; ++v) {
    for (std::size_t c = 0; c < 3; ++c) positions(v, c) = whole.positions[3 * v + c];
  }
  if (seen != nullptr) std::ranges::copy(whole.seen, seen);
  if (standard_error != nullptr) std::ranges::copy(whole.standard_error, standard_error);
  *report = {static_cast<std::int64_t>(whole.frame), whole.doubtful ? 1 : 0};
}

}  // namespace
}  // namespace dynmesh

using namespace dynmesh;

dynmesh_status dynmesh_whole_frame(const dynmesh_whole_frame_request* request,
                                   const dynmesh_output* positions, uint8_t* seen,
                                   double* standard_error, dynmesh_whole_frame_report* report) {
  return guarded([&] {
    check_pointer("request", request);
    if (request->source == nullptr) refuse("source", "is a null pointer");
    check_pointer("positions", positions);
    check_pointer("report", report);
    if (positions->type == DYNMESH_FLOAT32) {
      put_together<float>(*request, positions, seen, standard_error, report);
    } else if (positions->type == DYNMESH_FLOAT64) {
      put_together<double>(*request, positions, seen, standard_error, report);
    } else {
      refuse("positions", std::string("type must be ") + known_types + ", not " +
                              std::to_string(positions->type));
    }
  });
}
