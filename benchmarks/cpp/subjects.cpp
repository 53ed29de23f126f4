/// A completer and its plain twin behind C functions, for `benchmarks/subjects.py`: timed on the
/// frames that Python has and in the same run as everything else, but without Python in between.
///
/// Positions are packed rows of float, masks one byte per vertex. Nothing is checked.
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <dynmesh/topology.hpp>
#include <exception>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "generations/generations.hpp"
#include "motion/motion.hpp"

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
};

/// What dynmesh is.
class Product final : public Subject {
 public:
  Product(Faces faces, Points<const float> first_frame, Index threads)
      : completer_(faces, first_frame, {.threads = threads}) {}

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

/// The paper in plain words, as the tests compare the fast path with it.
class Plain final : public Subject {
 public:
  Plain(Faces faces, Points<const float> first_frame)
      : topology_(build_topology(faces, first_frame.count)),
        generations_(first_frame.count),
        motion_(topology_.cells, true, 0),
        previous_(first_frame.count),
        current_(first_frame.count),
        known_(first_frame.count) {
    reset(first_frame);
  }

  void reset(Points<const float> frame) override {
    for (std::size_t v = 0; v < frame.count; ++v) {
      previous_[v] = {frame(v, 0), frame(v, 1), frame(v, 2)};
    }
    motion_.reset(previous_);
  }
  void push(Points<const float> points, KnownMask known, Points<float> completed) override {
    for (std::size_t v = 0; v < points.count; ++v) {
      known_[v] = known[v] ? 1 : 0;
      current_[v] = known[v] ? Vector3<float>{points(v, 0), points(v, 1), points(v, 2)}
                             : previous_[v];  // where unseen vertices stay
    }
    motion_.estimate(previous_, current_, known_, generations_);
    for (std::size_t v = 0; v < points.count; ++v) {
      completed(v, 0) = current_[v].x;
      completed(v, 1) = current_[v].y;
      completed(v, 2) = current_[v].z;
    }
    std::swap(previous_, current_);
  }

 private:
  Topology topology_;
  Generations generations_;
  Motion<float> motion_;
  std::vector<Vector3<float>> previous_;
  std::vector<Vector3<float>> current_;
  std::vector<std::uint8_t> known_;
};

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

/// `threads` 0: the plain implementation. Null where the library refuses the arguments.
DYNMESH_FOR_PYTHON void* subject_create(const std::int32_t* faces, std::size_t n_faces,
                                        const float* first_frame, std::size_t n_vertices,
                                        std::int32_t threads) {
  using namespace dynmesh;
  try {
    std::unique_ptr<Subject> subject;
    const Points<const float> frame(first_frame, n_vertices);
    if (threads == 0) {
      subject = std::make_unique<Plain>(Faces{faces, n_faces}, frame);
    } else {
      subject = std::make_unique<Product>(Faces{faces, n_faces}, frame, threads);
    }
    return subject.release();
  } catch (const std::exception&) {
    return nullptr;
  }
}

DYNMESH_FOR_PYTHON void subject_destroy(void* subject) {
  delete static_cast<dynmesh::Subject*>(subject);
}

DYNMESH_FOR_PYTHON void subject_reset(void* subject, const float* frame, std::size_t n_vertices) {
  static_cast<dynmesh::Subject*>(subject)->reset({frame, n_vertices});
}

/// Pushes frame `order[0]` of `frames` with its mask, then frame `order[1]`, ..., and writes the
/// wall time of each call. Without `masks`, rows that are not finite are missing (not for the plain
/// implementation).
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

/// Pushes one frame as `push_sparse`, not with the plain implementation. Returns the wall time.
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
