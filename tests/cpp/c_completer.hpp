/// A completer by way of the C interface, with the calls of the one in C++, to which it must be
/// equal.
#pragma once

#include <dynmesh/dynmesh.h>

#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

namespace dynmesh::testing {

template <class Real>
constexpr std::int32_t type_of = sizeof(Real) == 4 ? DYNMESH_FLOAT32 : DYNMESH_FLOAT64;

/// The rows as dynmesh_points or dynmesh_output; strides of 0 if they are packed.
template <class View, class Real>
View c_view(Points<Real> rows) {
  const bool is_packed = rows.row_stride == 3 && rows.column_stride == 1;
  return {rows.data, static_cast<std::int64_t>(rows.count), is_packed ? 0 : rows.row_stride,
          is_packed ? 0 : rows.column_stride, type_of<std::remove_const_t<Real>>};
}

/// Packed positions, as C takes them.
inline dynmesh_points c_rows(const std::vector<double>& xyz) {
  return {xyz.data(), std::ssize(xyz) / 3, 0, 0, DYNMESH_FLOAT64};
}
inline dynmesh_output c_out(std::vector<double>& xyz) {
  return {xyz.data(), std::ssize(xyz) / 3, 0, 0, DYNMESH_FLOAT64};
}

/// Throws what a call was refused for.
inline void check_accepted(dynmesh_status status) {
  if (status != DYNMESH_OK) throw std::invalid_argument(dynmesh_last_message());
}

/// Whether a report of C says what one of C++ does, but for the time.
inline bool are_same(const dynmesh_frame_report& a, const FrameReport& b) {
  const auto number = [](std::size_t count) { return static_cast<std::int64_t>(count); };
  return std::tuple(a.known, a.filled, a.disconnected, a.rejected, a.iterations, a.blend,
                    a.prior_weight, a.prior_share, a.first_order_share, a.standard_error, a.quality,
                    std::string_view(a.reason)) ==
         std::tuple(number(b.known), number(b.filled), number(b.disconnected), number(b.rejected),
                    static_cast<std::int64_t>(b.iterations), b.stages.blend, b.stages.prior_weight,
                    b.stages.prior_share, b.stages.first_order_share, b.standard_error,
                    static_cast<std::int32_t>(b.quality), std::string_view(b.reason.data()));
}

template <class Real>
class CCompleter {
 public:
  /// A training sequence is destroyed before the first frame.
  CCompleter(Faces faces, Points<const Real> first_frame, const Settings& settings = {},
             const Training<Real>* training = nullptr) {
    const dynmesh_settings given = c_settings(settings);
    const auto frame = c_view<dynmesh_points>(first_frame);
    const auto n_faces = static_cast<std::int64_t>(faces.count);
    dynmesh_completer* made = nullptr;
    if (training == nullptr) {
      check_accepted(dynmesh_create(faces.data, n_faces, &frame, &given, &made));
    } else {
      dynmesh_training* shown = nullptr;
      check_accepted(dynmesh_training_create(frame.count, frame.type, &shown));
      const std::unique_ptr<dynmesh_training, Destroy> owner(shown);
      for (const auto& of_training : training->frames()) {
        const Points<const Real> rows(of_training.data(), of_training.size() / 3);
        const auto points = c_view<dynmesh_points>(rows);
        check_accepted(dynmesh_training_add(shown, &points));
      }
      check_accepted(dynmesh_create_trained(faces.data, n_faces, &frame, &given, shown, &made));
    }
    handle_.reset(made);
  }

  [[nodiscard]] dynmesh_completer* get() const { return handle_.get(); }

  void push(Points<const Real> points, KnownMask known, Points<Real> completed) {
    const auto given = c_view<dynmesh_points>(points);
    const auto out = c_view<dynmesh_output>(completed);
    const dynmesh_mask mask = {known.data, static_cast<std::int64_t>(known.count),
                               known.stride == 1 ? 0 : known.stride};
    check_accepted(dynmesh_push(get(), &given, &mask, &out, nullptr));
  }
  void push(Points<const Real> points, Points<Real> completed) {
    const auto given = c_view<dynmesh_points>(points);
    const auto out = c_view<dynmesh_output>(completed);
    check_accepted(dynmesh_push(get(), &given, nullptr, &out, nullptr));
  }
  void push_sparse(std::span<const Index> indices, Points<const Real> points,
                   Points<Real> completed) {
    const auto given = c_view<dynmesh_points>(points);
    const auto out = c_view<dynmesh_output>(completed);
    check_accepted(
        dynmesh_push_sparse(get(), indices.data(), std::ssize(indices), &given, &out, nullptr));
  }
  void skip(Points<Real> completed) {
    const auto out = c_view<dynmesh_output>(completed);
    check_accepted(dynmesh_skip(get(), &out, nullptr));
  }
  void reset(Points<const Real> frame) {
    const auto given = c_view<dynmesh_points>(frame);
    check_accepted(dynmesh_reset(get(), &given));
  }

  [[nodiscard]] std::vector<std::byte> state() const {
    std::int64_t size = 0;
    check_accepted(dynmesh_state_size(get(), &size));
    std::vector<std::byte> state(static_cast<std::size_t>(size));
    check_accepted(dynmesh_state(get(), state.data(), size));
    return state;
  }
  void restore(std::span<const std::byte> state) {
    check_accepted(dynmesh_restore(get(), state.data(), std::ssize(state)));
  }

  [[nodiscard]] std::size_t n_vertices() const {
    return static_cast<std::size_t>(dynmesh_n_vertices(get()));
  }
  [[nodiscard]] std::span<const Index> generation() const {
    return {dynmesh_generation(get()), n_vertices()};
  }
  [[nodiscard]] std::span<const Index> age() const { return {dynmesh_age(get()), n_vertices()}; }
  [[nodiscard]] std::vector<Real> standard_error() const {
    std::vector<Real> values(n_vertices());
    check_accepted(dynmesh_standard_error(get(), values.data(), std::ssize(values), type_of<Real>));
    return values;
  }
  [[nodiscard]] dynmesh_frame_report report() const {
    dynmesh_frame_report report{};
    check_accepted(dynmesh_report(get(), &report));
    return report;
  }

 private:
  struct Destroy {
    void operator()(dynmesh_completer* completer) const { dynmesh_destroy(completer); }
    void operator()(dynmesh_training* training) const { dynmesh_training_destroy(training); }
  };

  static dynmesh_settings c_settings(const Settings& settings) {
    dynmesh_settings given;
    check_accepted(dynmesh_default_settings(&given, sizeof given));
    given.method =
        settings.method == Method::detail ? DYNMESH_METHOD_DETAIL : DYNMESH_METHOD_MOTION;
    given.revisit = settings.revisit ? 1 : 0;
    given.extra_iterations = settings.extra_iterations;
    given.disconnected = settings.disconnected == DisconnectedRule::hold
                             ? DYNMESH_DISCONNECTED_HOLD
                             : DYNMESH_DISCONNECTED_FOLLOW;
    given.noise = settings.noise.value_or(std::numeric_limits<double>::quiet_NaN());
    given.reject_outliers = settings.reject_outliers ? 1 : 0;
    given.learn = settings.learn ? 1 : 0;
    given.uncertainty = settings.uncertainty ? 1 : 0;
    given.threads = settings.threads;
    return given;
  }

  std::unique_ptr<dynmesh_completer, Destroy> handle_;
};

}  // namespace dynmesh::testing
