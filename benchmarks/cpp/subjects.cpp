/// C functions that build, call and time methods, for `benchmarks/compiled.py`. The frames come
/// from Python, and the calls are timed without Python in between.
///
/// Positions are packed rows of float, masks have one byte per vertex. Nothing is checked.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "constants.hpp"
#include "detail/detail.hpp"
#include "generations/estimator.hpp"
#include "generations/generations.hpp"
#include "generations/in_double_precision.hpp"
#include "motion/motion.hpp"
#include "support/workers.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

/// A method without the checks and steps that a completer adds.
class Subject {
 public:
  using Make = std::unique_ptr<Estimator<float>> (*)(Faces, const Topology&, Workers&,
                                                     const DetailConstants&);

  Subject(Faces faces, Points<const float> first_frame, Make make, const DetailConstants& constants)
      : topology_(build_topology(faces, first_frame.count)),
        workers_(1),
        generations_(first_frame.count),
        estimator_(make(faces, topology_, workers_, constants)),
        previous_(first_frame.count),
        current_(first_frame.count),
        known_(first_frame.count) {
    for (std::size_t v = 0; v < first_frame.count; ++v) {
      previous_[v] = {first_frame(v, 0), first_frame(v, 1), first_frame(v, 2)};
    }
    estimator_->reset(previous_);
  }

  void push(Points<const float> points, KnownMask known, Points<float> completed) {
    for (std::size_t v = 0; v < points.count; ++v) {
      known_[v] = known[v] ? 1 : 0;
      current_[v] = known[v] ? Vector3<float>{points(v, 0), points(v, 1), points(v, 2)}
                             : previous_[v];  // disconnected vertices keep their position
    }
    estimator_->estimate(previous_, current_, known_, generations_);
    estimator_->remember(current_);
    for (std::size_t v = 0; v < points.count; ++v) {
      completed(v, 0) = current_[v].x;
      completed(v, 1) = current_[v].y;
      completed(v, 2) = current_[v].z;
    }
    std::swap(previous_, current_);
  }
  [[nodiscard]] const Estimator<float>& estimator() const { return *estimator_; }
  /// (k,) of the last frame.
  [[nodiscard]] std::span<const Index> generation() const { return generations_.of_vertices(); }

 private:
  Topology topology_;
  Workers workers_;
  Generations generations_;
  std::unique_ptr<Estimator<float>> estimator_;
  std::vector<Vector3<float>> previous_;
  std::vector<Vector3<float>> current_;
  std::vector<std::uint8_t> known_;
};

/// The direct implementation of the paper, which the tests compare the fast one with.
std::unique_ptr<Estimator<float>> plain(Faces /*faces*/, const Topology& topology,
                                        Workers& /*workers*/,
                                        const DetailConstants& /*constants*/) {
  return std::make_unique<Motion<float>>(topology.cells, true, 0);
}

template <bool with_errors>
std::unique_ptr<Estimator<float>> detail(Faces faces, const Topology& topology, Workers& workers,
                                         const DetailConstants& constants) {
  std::vector<Triangle> triangles(faces.count);
  for (std::size_t f = 0; f < faces.count; ++f) triangles[f] = faces[f];
  return std::make_unique<InDoublePrecision>(
      std::make_unique<Detail>(std::move(triangles), topology, std::nullopt, workers, constants,
                               TrainingFrames{}, false, with_errors),
      topology.cells.size());
}

}  // namespace
}  // namespace dynmesh

extern "C" {
#define DYNMESH_FOR_PYTHON __attribute__((visibility("default")))

/// These return the names of the constants by number, and write their values; null after the last.
DYNMESH_FOR_PYTHON const char* detail_constant(std::size_t number, double* value) {
  return dynmesh::nth<dynmesh::DetailConstants>(dynmesh::detail_constants, number, *value);
}
DYNMESH_FOR_PYTHON const char* uncertainty_constant(std::size_t number, double* value) {
  return dynmesh::nth<dynmesh::UncertaintyConstants>(dynmesh::uncertainty_constants, number,
                                                     *value);
}

/// Builds method detail with one constant changed, with standard errors if its name begins with
/// "uncertainty.", or the plain implementation of method motion if it is empty. Returns null if the
/// library refuses the arguments.
DYNMESH_FOR_PYTHON void* subject_create(const std::int32_t* faces, std::size_t n_faces,
                                        const float* first_frame, std::size_t n_vertices,
                                        const char* constant, double factor) {
  using namespace dynmesh;
  try {
    DetailConstants constants;
    constexpr std::string_view of_errors = "uncertainty.";
    const std::string_view name = constant;
    Subject::Make make = plain;
    if (name.starts_with(of_errors)) {
      make = detail<true>;
      if (!scale<UncertaintyConstants>(constants.uncertainty, uncertainty_constants,
                                       name.substr(of_errors.size()), factor)) {
        return nullptr;
      }
    } else if (!name.empty()) {
      make = detail<false>;
      if (!scale<DetailConstants>(constants, detail_constants, name, factor)) return nullptr;
    }
    const Points<const float> frame(first_frame, n_vertices);
    return std::make_unique<Subject>(Faces{faces, n_faces}, frame, make, constants).release();
  } catch (const std::exception&) {
    return nullptr;
  }
}

DYNMESH_FOR_PYTHON void subject_destroy(void* subject) {
  delete static_cast<dynmesh::Subject*>(subject);
}

/// Copies the standard errors and the generations of the last frame, (k,) each, of a subject that
/// has standard errors.
DYNMESH_FOR_PYTHON void subject_error_bars(const void* subject, double* standard_errors,
                                           std::int32_t* generation) {
  const auto& asked = *static_cast<const dynmesh::Subject*>(subject);
  std::ranges::copy(asked.estimator().standard_error(), standard_errors);
  std::ranges::copy(asked.generation(), generation);
}

/// Completes a frame, and returns the wall time in nanoseconds.
DYNMESH_FOR_PYTHON std::int64_t subject_push(void* subject, const float* points,
                                             const std::uint8_t* known, std::size_t n_vertices,
                                             float* completed) {
  using namespace dynmesh;
  auto& pushed = *static_cast<Subject*>(subject);
  const auto start = Clock::now();
  pushed.push({points, n_vertices}, {known, n_vertices}, {completed, n_vertices});
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - start).count();
}
}
