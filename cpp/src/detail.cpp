#include "detail.hpp"

#include <algorithm>
#include <utility>

#include "geometry.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

/// Rounds of turning and solving; two nearly suffice.
constexpr int rounds = 3;

constexpr Index stretch = 512;  // vertices that a thread takes at a time

/// Adds the time of its scope to a stage.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  double& seconds_;
  Clock::time_point start_ = Clock::now();
};

/// N = K^T K = C M^-1 C.
SymmetricMatrix normal_matrix(const DetailOperator& k) {
  SymmetricMatrix normal;
  normal.offsets.push_back(0);
  std::vector<double> sums(k.size(), 0);
  std::vector<std::uint8_t> is_set(k.size(), 0);
  std::vector<Index> rows;
  const auto at = [](Index i) { return static_cast<std::size_t>(i); };
  for (std::size_t j = 0; j < k.size(); ++j) {
    rows.clear();
    for (Index e = k.offsets[j]; e < k.offsets[j + 1]; ++e) {
      const std::size_t l = at(k.columns[at(e)]);
      const double weight = k.values[at(e)] * k.scale[l] * k.scale[l];
      for (Index f = k.offsets[l]; f < k.offsets[l + 1]; ++f) {
        const Index i = k.columns[at(f)];
        if (is_set[at(i)] == 0) rows.push_back(i);
        is_set[at(i)] = 1;
        sums[at(i)] += weight * k.values[at(f)];
      }
    }
    std::sort(rows.begin(), rows.end());
    for (const Index i : rows) {
      normal.rows.push_back(i);
      normal.values.push_back(sums[at(i)]);
      sums[at(i)] = 0;
      is_set[at(i)] = 0;
    }
    normal.offsets.push_back(static_cast<Index>(normal.rows.size()));
  }
  return normal;
}

/// A rotation matrix, by rows.
struct Turn {
  Vector3<double> rows[3];

  explicit Turn(const Quaternion& q) {
    const double xx = 2 * q.x * q.x, yy = 2 * q.y * q.y, zz = 2 * q.z * q.z;
    const double xy = 2 * q.x * q.y, xz = 2 * q.x * q.z, yz = 2 * q.y * q.z;
    const double wx = 2 * q.w * q.x, wy = 2 * q.w * q.y, wz = 2 * q.w * q.z;
    rows[0] = {1 - yy - zz, xy - wz, xz + wy};
    rows[1] = {xy + wz, 1 - xx - zz, yz - wx};
    rows[2] = {xz - wy, yz + wx, 1 - xx - yy};
  }
  [[nodiscard]] Vector3<double> forth(const Vector3<double>& v) const {
    const auto along = [&](const Vector3<double>& r) { return r.x * v.x + r.y * v.y + r.z * v.z; };
    return {along(rows[0]), along(rows[1]), along(rows[2])};
  }
  [[nodiscard]] Vector3<double> back(const Vector3<double>& v) const {
    return v.x * rows[0] + v.y * rows[1] + v.z * rows[2];
  }
};

}  // namespace

template <class Real>
Detail<Real>::Detail(std::vector<Triangle> faces, const Topology& topology, Workers& workers)
    : faces_(std::move(faces)),
      topology_(topology),
      workers_(workers),
      rotations_(topology.cells, workers),
      local_blend_(topology.cells),
      solved_(topology.cells.size()),
      counts_(topology.cells.size()) {
  for (Positions* positions : {&first_memory_, &memory_, &x_, &kx_, &turned_, &change_, &step_,
                               &change_step_, &r0_, &r1_, &scaled_}) {
    positions->resize(topology.cells.size());
  }
}

template <class Real>
void Detail<Real>::reset(Frame first_frame) {
  operator_ = build_detail_operator<Real>(faces_, topology_.cells, first_frame);
  factor_ = std::make_unique<MaskedFactor>(normal_matrix(operator_));
  take(first_frame);
  rotations_.reset(x_, static_cast<double>(mean_edge_length(topology_.cells, first_frame)));
  apply_operator(x_, first_memory_);
  memory_ = first_memory_;
  report_ = {};
}

template <class Real>
void Detail<Real>::take(Frame frame) {
  for (std::size_t v = 0; v < frame.size(); ++v) {
    x_[v] = {static_cast<double>(frame[v].x), static_cast<double>(frame[v].y),
             static_cast<double>(frame[v].z)};
  }
}

/// kx = K x.
template <class Real>
void Detail<Real>::apply_operator(const Positions& x, Positions& kx) {
  const auto k = static_cast<Index>(x.size());
  workers_.for_each((k + stretch - 1) / stretch, [&](Index s) {
    const auto last = static_cast<std::size_t>(std::min(k, (s + 1) * stretch));
    for (auto i = static_cast<std::size_t>(s * stretch); i < last; ++i) {
      Vector3<double> sum;
      for (Index e = operator_.offsets[i]; e < operator_.offsets[i + 1]; ++e) {
        const auto entry = static_cast<std::size_t>(e);
        sum = sum + operator_.values[entry] * x[static_cast<std::size_t>(operator_.columns[entry])];
      }
      kx[i] = operator_.scale[i] * sum;
    }
  });
}

/// ktr = K^T r.
template <class Real>
void Detail<Real>::apply_transposed(const Positions& r, Positions& ktr) {
  for (std::size_t i = 0; i < r.size(); ++i) scaled_[i] = operator_.scale[i] * r[i];
  const auto k = static_cast<Index>(r.size());
  workers_.for_each((k + stretch - 1) / stretch, [&](Index s) {
    const auto last = static_cast<std::size_t>(std::min(k, (s + 1) * stretch));
    for (auto i = static_cast<std::size_t>(s * stretch); i < last; ++i) {
      Vector3<double> sum;
      for (Index e = operator_.offsets[i]; e < operator_.offsets[i + 1]; ++e) {
        const auto entry = static_cast<std::size_t>(e);
        sum = sum +
              operator_.values[entry] * scaled_[static_cast<std::size_t>(operator_.columns[entry])];
      }
      ktr[i] = sum;
    }
  });
}

template <class Real>
Index Detail<Real>::estimate(Frame previous, std::span<Vector3<Real>> points,
                             std::span<const std::uint8_t> known, Generations& generations) {
  generations.classify(topology_.cells, known);
  report_ = {};
  if (generations.reached() == 0) return 0;

  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < known.size(); ++v) {
    solved_[v] = generation[v] > 0 ? 1 : 0;
    counts_[v] = generation[v] >= 0 ? 1 : 0;
  }
  {
    const Stopwatch stopwatch(report_.factor_seconds);
    factor_->factorize(solved_);
  }
  {
    // The smoothest motion from the last frame: min |K (X - X_prev)|^2.
    const Stopwatch stopwatch(report_.solve_seconds);
    take(previous);
    for (std::size_t v = 0; v < known.size(); ++v) {
      change_[v] = {};
      if (generation[v] != Generations::anchor) continue;
      const Vector3<double> point = {static_cast<double>(points[v].x),
                                     static_cast<double>(points[v].y),
                                     static_cast<double>(points[v].z)};
      change_[v] = point - x_[v];
      x_[v] = point;
    }
    apply_operator(change_, kx_);
    apply_transposed(kx_, step_);
    factor_->solve(step_);
    for (std::size_t v = 0; v < known.size(); ++v) {
      if (solved_[v] != 0) x_[v] = x_[v] - step_[v];
    }
    apply_operator(x_, kx_);
  }
  for (int round = 0; round < rounds; ++round) {
    {
      const Stopwatch stopwatch(report_.rotation_seconds);
      rotations_.fit(x_);
      turn_memory();
    }
    const Stopwatch stopwatch(report_.solve_seconds);
    solve_round();
  }
  const Stopwatch stopwatch(report_.solve_seconds);
  solve_local_blend();
  for (std::size_t v = 0; v < known.size(); ++v) {
    if (solved_[v] == 0) continue;
    points[v] = {static_cast<Real>(x_[v].x), static_cast<Real>(x_[v].y),
                 static_cast<Real>(x_[v].z)};
  }
  return rounds;
}

template <class Real>
void Detail<Real>::turn_memory() {
  const auto quaternions = rotations_.quaternions();
  for (std::size_t v = 0; v < memory_.size(); ++v) {
    const Turn turn(quaternions[v]);
    turned_[v] = turn.forth(memory_[v]);
    change_[v] = turn.forth(first_memory_[v] - memory_[v]);
  }
}

/// The best X for these rotations, and the blend that the anchors support.
template <class Real>
void Detail<Real>::solve_round() {
  for (std::size_t v = 0; v < x_.size(); ++v) r0_[v] = turned_[v] - kx_[v];
  apply_transposed(r0_, step_);
  apply_transposed(change_, change_step_);
  factor_->solve(step_, change_step_);
  for (std::size_t v = 0; v < x_.size(); ++v) {
    if (solved_[v] == 0) step_[v] = change_step_[v] = {};
  }
  apply_operator(step_, r0_);
  apply_operator(change_step_, r1_);
  for (std::size_t v = 0; v < x_.size(); ++v) {
    const bool counts = counts_[v] != 0;
    r0_[v] = counts ? kx_[v] + r0_[v] - turned_[v] : Vector3<double>{};
    r1_[v] = counts ? r1_[v] - change_[v] : Vector3<double>{};
  }
  const double b = report_.blend = global_blend(r0_, r1_);
  for (std::size_t v = 0; v < x_.size(); ++v) {
    x_[v] = x_[v] + step_[v] + b * change_step_[v];
    kx_[v] = r0_[v] + turned_[v] + b * (r1_[v] + change_[v]);
  }
}

/// The same rotations once more, with a blend that varies over the surface.
template <class Real>
void Detail<Real>::solve_local_blend() {
  const auto blend = local_blend_.find(r0_, r1_, report_.blend);
  for (std::size_t v = 0; v < x_.size(); ++v) r0_[v] = turned_[v] + blend[v] * change_[v] - kx_[v];
  apply_transposed(r0_, step_);
  factor_->solve(step_);
  for (std::size_t v = 0; v < x_.size(); ++v) {
    if (solved_[v] != 0) x_[v] = x_[v] + step_[v];
  }
}

template <class Real>
void Detail<Real>::remember(Frame completed) {
  take(completed);
  {
    const Stopwatch stopwatch(report_.rotation_seconds);
    rotations_.fit(x_);
  }
  apply_operator(x_, kx_);
  const auto quaternions = std::as_const(rotations_).quaternions();
  for (std::size_t v = 0; v < x_.size(); ++v) memory_[v] = Turn(quaternions[v]).back(kx_[v]);
}

template <class Real>
typename Detail<Real>::Memory Detail<Real>::memory() const {
  Memory memory;
  for (const Quaternion& q : rotations_.quaternions()) memory.push_back({q.w, q.x, q.y, q.z});
  return memory;
}

template <class Real>
void Detail<Real>::recall(const Memory& memory, Frame completed) {
  std::ranges::transform(memory, rotations_.quaternions().begin(), [](const auto& row) {
    return Quaternion{row[0], row[1], row[2], row[3]};
  });
  take(completed);
  apply_operator(x_, kx_);
  const auto quaternions = std::as_const(rotations_).quaternions();
  for (std::size_t v = 0; v < x_.size(); ++v) memory_[v] = Turn(quaternions[v]).back(kx_[v]);
}

template class Detail<float>;
template class Detail<double>;

}  // namespace dynmesh
