/// Lets a method that computes in double precision estimate frames of single precision.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "generations/estimator.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

/// Converts frames on the way in and out. Allocates memory only in the constructor, beside what the
/// method allocates.
class InDoublePrecision final : public Estimator<float> {
 public:
  InDoublePrecision(std::unique_ptr<Estimator<double>> method, std::size_t n_vertices)
      : method_(std::move(method)), previous_(n_vertices), points_(n_vertices) {}

  void reset(Frame first_frame) override { method_->reset(widened(first_frame, points_)); }

  Index estimate(Frame previous, std::span<Vector3<float>> points,
                 std::span<const std::uint8_t> known, Generations& generations) override {
    widened(previous, previous_);
    widened(points, points_);
    const Index iterations = method_->estimate(previous_, points_, known, generations);
    const auto generation = generations.of_vertices();
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (generation[v] == Generations::disconnected) continue;
      const Vector3<double>& x = points_[v];
      points[v] = {saturated<float>(x.x), saturated<float>(x.y), saturated<float>(x.z)};
    }
    return iterations;
  }

  void remember(Frame completed) override { method_->remember(widened(completed, points_)); }

  void write_memory(Writer& writer) const override { method_->write_memory(writer); }
  [[nodiscard]] std::size_t memory_size() const override { return method_->memory_size(); }
  void read_memory(Reader& reader, Frame completed) override {
    method_->read_memory(reader, widened(completed, points_));
  }
  [[nodiscard]] std::span<const double> standard_error() const override {
    return method_->standard_error();
  }
  [[nodiscard]] StageReport stages() const override { return method_->stages(); }

 private:
  static std::span<const Vector3<double>> widened(Frame frame,
                                                  std::vector<Vector3<double>>& converted) {
    std::ranges::transform(frame, converted.begin(), in_double<float>);
    return converted;
  }

  std::unique_ptr<Estimator<double>> method_;
  std::vector<Vector3<double>> previous_;
  std::vector<Vector3<double>> points_;
};

}  // namespace dynmesh
