/// C functions that build, call and time completers, for `benchmarks/subjects.py`. The frames come
/// from Python, and the calls are timed in the same run as all others, without Python in between.
///
/// Positions are packed rows of float, masks have one byte per vertex. Nothing is checked.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <dynmesh/topology.hpp>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "detail/detail.hpp"
#include "generations/estimator.hpp"
#include "generations/generations.hpp"
#include "generations/in_double_precision.hpp"
#include "motion/motion.hpp"
#include "support/workers.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

class Subject {
 public:
  Subject() = default;
  Subject(const Subject&) = delete;
  Subject& operator=(const Subject&) = delete;
  Subject(Subject&&) = delete;
  Subject& operator=(Subject&&) = delete;
  virtual ~Subject() = default;
  virtual void reset(Points<const float> frame) = 0;
  virtual void push(Points<const float> points, KnownMask known, Points<float> completed) = 0;
  /// The estimator, or null if there is a completer around it.
  [[nodiscard]] virtual const Estimator<float>* estimator() const { return nullptr; }
  /// (k,) of the last frame, or empty.
  [[nodiscard]] virtual std::span<const Index> generation() const { return {}; }
};

/// The completer that users of the library have.
class Product final : public Subject {
 public:
  Product(Faces faces, Points<const float> first_frame, Index threads)
      : completer_(faces, first_frame, {.method = Method::motion, .threads = threads}) {}

  void reset(Points<const float> frame) override { completer_.reset(frame); }
  void push(Points<const float> points, KnownMask known, Points<float> completed) override {
    if (known.data == nullptr) {
      completer_.push(points, completed);
    } else {
      completer_.push(points, known, completed);
    }
  }
  void push_sparse(std::span<const Index> indices, Points<const float> points,
                   Points<float> completed) {
    completer_.push_sparse(indices, points, completed);
  }

 private:
  Completer<float> completer_;
};

/// A method without the checks and steps that a completer adds.
class Bare final : public Subject {
 public:
  using Make = std::unique_ptr<Estimator<float>> (*)(Faces, const Topology&, Workers&,
                                                     const DetailConstants&);

  Bare(Faces faces, Points<const float> first_frame, Make make,
       const DetailConstants& constants = {})
      : topology_(build_topology(faces, first_frame.count)),
        workers_(1),
        generations_(first_frame.count),
        estimator_(make(faces, topology_, workers_, constants)),
        previous_(first_frame.count),
        current_(first_frame.count),
        known_(first_frame.count) {
    reset(first_frame);
  }

  void reset(Points<const float> frame) override {
    for (std::size_t v = 0; v < frame.count; ++v) {
      previous_[v] = {frame(v, 0), frame(v, 1), frame(v, 2)};
    }
    estimator_->reset(previous_);
  }
  void push(Points<const float> points, KnownMask known, Points<float> completed) override {
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
  [[nodiscard]] const Estimator<float>* estimator() const override { return estimator_.get(); }
  [[nodiscard]] std::span<const Index> generation() const override {
    return generations_.of_vertices();
  }

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

std::unique_ptr<Estimator<float>> detail(Faces faces, const Topology& topology, Workers& workers,
                                         const DetailConstants& constants) {
  std::vector<Triangle> triangles(faces.count);
  for (std::size_t f = 0; f < faces.count; ++f) triangles[f] = faces[f];
  return std::make_unique<InDoublePrecision>(
      std::make_unique<Detail>(std::move(triangles), topology, std::nullopt, workers, constants),
      topology.cells.size());
}

/// Method detail with standard errors.
std::unique_ptr<Estimator<float>> detail_with_errors(Faces faces, const Topology& topology,
                                                     Workers& workers,
                                                     const DetailConstants& constants) {
  std::vector<Triangle> triangles(faces.count);
  for (std::size_t f = 0; f < faces.count; ++f) triangles[f] = faces[f];
  return std::make_unique<InDoublePrecision>(
      std::make_unique<Detail>(std::move(triangles), topology, std::nullopt, workers, constants,
                               TrainingFrames{}, false, true),
      topology.cells.size());
}

/// Does the same as the other `scale` for the constants of error bars; shares that are kept are
/// scaled in 1 - share.
bool scale(UncertaintyConstants& constants, std::string_view name, double factor) {
  const std::pair<std::string_view, int UncertaintyConstants::*> counts[] = {
      {"smoothings", &UncertaintyConstants::smoothings},
      {"averagings", &UncertaintyConstants::averagings},
      {"variance_averagings", &UncertaintyConstants::variance_averagings}};
  for (const auto& [known, member] : counts) {
    if (name != known) continue;
    constants.*member = std::max(1, static_cast<int>(std::lround(constants.*member * factor)));
    return true;
  }
  const std::pair<std::string_view, double UncertaintyConstants::*> numbers[] = {
      {"shared_change", &UncertaintyConstants::shared_change},
      {"1 - kept", &UncertaintyConstants::kept},
      {"1 - kept_in_the_long_run", &UncertaintyConstants::kept_in_the_long_run},
      {"first_persistence", &UncertaintyConstants::first_persistence},
      {"1 - largest_persistence", &UncertaintyConstants::largest_persistence},
      {"pull", &UncertaintyConstants::pull},
      {"least_size", &UncertaintyConstants::least_size},
      {"largest_size", &UncertaintyConstants::largest_size}};
  for (const auto& [known, member] : numbers) {
    if (name != known) continue;
    double& value = constants.*member;
    value = known.starts_with("1 - ") ? 1 - factor * (1 - value) : factor * value;
    return true;
  }
  return false;
}

/// Multiplies the constant `name` by `factor`; numbers of steps are rounded, and at least 1.
/// Returns whether there is a constant of that name.
bool scale(DetailConstants& constants, std::string_view name, double factor) {
  const std::pair<std::string_view, int DetailConstants::*> counts[] = {
      {"rounds", &DetailConstants::rounds}, {"averagings", &DetailConstants::averagings}};
  for (const auto& [known, member] : counts) {
    if (name != known) continue;
    constants.*member = std::max(1, static_cast<int>(std::lround(constants.*member * factor)));
    return true;
  }
  const std::pair<std::string_view, double DetailConstants::*> numbers[] = {
      {"caution - 1", &DetailConstants::caution},
      {"caution_of_change - 1", &DetailConstants::caution_of_change},
      {"least_explained", &DetailConstants::least_explained},
      {"pull", &DetailConstants::pull},
      {"least_blend", &DetailConstants::least_blend},
      {"largest_blend", &DetailConstants::largest_blend},
      {"newest", &DetailConstants::newest},
      {"least_area", &DetailConstants::least_area}};
  for (const auto& [known, member] : numbers) {
    if (name != known) continue;
    const double above = known.ends_with("- 1") ? 1 : 0;
    constants.*member = above + factor * (constants.*member - above);
    return true;
  }
  return false;
}

template <class Call>
std::int64_t nanoseconds_of(const Call& call) {
  const auto start = Clock::now();
  call();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - start).count();
}

}  // namespace
}  // namespace dynmesh

extern "C" {
#define DYNMESH_FOR_PYTHON __attribute__((visibility("default")))

/// Builds a completer, or the plain implementation if `threads` is 0. Returns null if the library
/// refuses the arguments.
DYNMESH_FOR_PYTHON void* subject_create(const std::int32_t* faces, std::size_t n_faces,
                                        const float* first_frame, std::size_t n_vertices,
                                        std::int32_t threads) {
  using namespace dynmesh;
  try {
    std::unique_ptr<Subject> subject;
    const Points<const float> frame(first_frame, n_vertices);
    if (threads == 0) {
      subject = std::make_unique<Bare>(Faces{faces, n_faces}, frame, plain);
    } else {
      subject = std::make_unique<Product>(Faces{faces, n_faces}, frame, threads);
    }
    return subject.release();
  } catch (const std::exception&) {
    return nullptr;
  }
}

/// Builds method detail with one constant changed, with standard errors if its name begins with
/// "uncertainty.". Returns null if the library refuses the
/// arguments.
DYNMESH_FOR_PYTHON void* subject_create_varied(const std::int32_t* faces, std::size_t n_faces,
                                               const float* first_frame, std::size_t n_vertices,
                                               const char* constant, double factor) {
  using namespace dynmesh;
  try {
    DetailConstants constants;
    constexpr std::string_view of_errors = "uncertainty.";
    const std::string_view name = constant;
    const bool has_errors = name.starts_with(of_errors);
    if (!(has_errors ? scale(constants.uncertainty, name.substr(of_errors.size()), factor)
                     : scale(constants, name, factor))) {
      return nullptr;
    }
    const Points<const float> frame(first_frame, n_vertices);
    return std::make_unique<Bare>(Faces{faces, n_faces}, frame,
                                  has_errors ? detail_with_errors : detail, constants)
        .release();
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
  std::ranges::copy(asked.estimator()->standard_error(), standard_errors);
  std::ranges::copy(asked.generation(), generation);
}

DYNMESH_FOR_PYTHON void subject_reset(void* subject, const float* frame, std::size_t n_vertices) {
  static_cast<dynmesh::Subject*>(subject)->reset({frame, n_vertices});
}

/// Pushes frame `order[0]` of `frames` with its mask, then frame `order[1]`, ..., and writes the
/// wall time of each call. If `masks` is null, vertices that are not finite are unknown; the plain
/// implementation does not support this.
DYNMESH_FOR_PYTHON void subject_push(void* subject, const float* frames, const std::uint8_t* masks,
                                     std::size_t n_vertices, const std::int64_t* order,
                                     std::size_t n, float* completed, std::int64_t* nanoseconds) {
  using namespace dynmesh;
  auto& pushed = *static_cast<Subject*>(subject);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t first = static_cast<std::size_t>(order[i]) * n_vertices;
    const Points<const float> points(frames + 3 * first, n_vertices);
    const KnownMask known(masks == nullptr ? nullptr : masks + first, n_vertices);
    nanoseconds[i] = nanoseconds_of([&] { pushed.push(points, known, {completed, n_vertices}); });
  }
}

/// Pushes one frame by `push_sparse` and returns the wall time. The plain implementation does not
/// support this.
DYNMESH_FOR_PYTHON std::int64_t subject_push_sparse(void* subject, const std::int32_t* indices,
                                                    const float* points, std::size_t n,
                                                    float* completed, std::size_t n_vertices) {
  using namespace dynmesh;
  auto& pushed = dynamic_cast<Product&>(*static_cast<Subject*>(subject));
  return nanoseconds_of([&] {
    pushed.push_sparse({indices, n}, {points, n}, {completed, n_vertices});
  });
}
}
