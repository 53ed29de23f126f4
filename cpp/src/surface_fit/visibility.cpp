#include "surface_fit/visibility.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "surface_fit/view.hpp"

namespace dynmesh {
namespace {

constexpr double pixels_of_edge = 2;
/// What lies before a vertex by less than this many mean edges does not hide it.
constexpr double least_gap = 0.1;

/// An image of a surface of several components: of each pixel, what is nearest (Catmull 1974).
class Picture {
 public:
  Picture(std::span<const Triangle> faces, std::span<const Index> component, View view,
          double mean_edge)
      : component_(component),
        view_(std::move(view)),
        mean_edge_(mean_edge),
        nearest_(static_cast<std::size_t>(view_.width() * view_.height())) {
    if (!view_.any()) return;  // a surface without extent hides nothing
    for (const Triangle& face : faces) draw(face);
  }

  /// Whether another component lies before a vertex.
  [[nodiscard]] bool hides(std::size_t vertex) const {
    if (!view_.any()) return false;
    const auto& [u, v, z] = view_.place_of(vertex);
    const auto& [depth, component] = nearest_[number_of(u, v)];
    return component != -1 && component != component_[vertex] && depth < z - least_gap * mean_edge_;
  }
  /// Adds the number of its pixels to each component.
  void count(std::span<double> pixels) const {
    for (const Pixel& pixel : nearest_) {
      if (pixel.component != -1) pixels[at(pixel.component)] += 1;
    }
  }

 private:
  struct Pixel {
    double depth = std::numeric_limits<double>::infinity();
    Index component = -1;
  };

  /// Of the pixel around a place.
  [[nodiscard]] std::size_t number_of(double u, double v) const {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(v) * view_.width() +
                                    static_cast<std::ptrdiff_t>(u));
  }
  void draw(const Triangle& face) {
    const auto& a = view_.place_of(at(face[0]));
    const auto& b = view_.place_of(at(face[1]));
    const auto& c = view_.place_of(at(face[2]));
    const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if (area == 0) return;
    // Of the shares of b and c, where the pixel moves by one along a row and a column.
    const double scale = 1 / area;
    const double b_along = scale * (c[1] - a[1]);
    const double b_across = -scale * (c[0] - a[0]);
    const double c_along = -scale * (b[1] - a[1]);
    const double c_across = scale * (b[0] - a[0]);
    const auto first = [](double p, double q, double r) {
      return static_cast<std::ptrdiff_t>(std::ceil(std::min({p, q, r}) - 0.5));
    };
    const auto last = [](double p, double q, double r) {
      return static_cast<std::ptrdiff_t>(std::floor(std::max({p, q, r}) - 0.5));
    };
    const Index component = component_[at(face[0])];
    const std::ptrdiff_t end_u = last(a[0], b[0], c[0]);
    const std::ptrdiff_t end_v = last(a[1], b[1], c[1]);
    for (std::ptrdiff_t v = first(a[1], b[1], c[1]); v <= end_v; ++v) {
      for (std::ptrdiff_t u = first(a[0], b[0], c[0]); u <= end_u; ++u) {
        const double from_u = static_cast<double>(u) + 0.5 - a[0];
        const double from_v = static_cast<double>(v) + 0.5 - a[1];
        const double share_b = from_u * b_along + from_v * b_across;
        const double share_c = from_u * c_along + from_v * c_across;
        if (share_b < 0 || share_c < 0 || share_b + share_c > 1) continue;
        const double depth = a[2] + share_b * (b[2] - a[2]) + share_c * (c[2] - a[2]);
        Pixel& pixel = nearest_[static_cast<std::size_t>(v * view_.width() + u)];
        if (depth < pixel.depth) pixel = {depth, component};
      }
    }
  }

  std::span<const Index> component_;
  View view_;
  double mean_edge_;
  std::vector<Pixel> nearest_;
};

}  // namespace

Visibility find_visibility(std::span<const Triangle> faces, std::span<const Index> component,
                           Field x, Field normals, std::span<const std::uint8_t> is_sheet,
                           Field sensors, double mean_edge, Workers& workers) {
  const std::size_t k = x.size();
  Eigen::AlignedBox3d box;
  for (const Vector3& position : x) box.extend(to_eigen(position));
  const std::vector<Viewpoint> from = viewpoints_of(sensors, box);
  constexpr std::uint8_t faces_it = 1;
  constexpr std::uint8_t sees_it = 2;
  std::vector<std::vector<std::uint8_t>> views(from.size());
  std::vector<std::vector<double>> pixels(from.size());
  const Index last = component.empty() ? -1 : *std::ranges::max_element(component);
  workers.for_each_in_chunks(
      from.size(),
      [&](std::size_t s) {
        views[s].resize(k);
        const Eigen::Vector3d& sensor = from[s].position;
        const bool is_inside = box.contains(sensor);
        std::optional<Picture> picture;
        pixels[s].resize(at(last + 1));
        if (!is_inside) {
          View view(x, sensor, box, mean_edge, pixels_of_edge);
          picture.emplace(faces, component, std::move(view), mean_edge);
          picture->count(pixels[s]);
        }
        for (std::size_t v = 0; v < k; ++v) {
          const auto towards = from_eigen(sensor) - x[v];
          if (is_sheet[v] == 0 && !(dot(normals[v], towards) > 0)) continue;
          views[s][v] = faces_it;
          if (!picture || !picture->hides(v)) views[s][v] |= sees_it;
        }
      },
      static_cast<Index>(k));
  Visibility found{std::vector<std::uint8_t>(k), {}, {}};
  std::vector<std::uint8_t> is_hidden(k);
  for (std::size_t v = 0; v < k; ++v) {
    std::uint8_t any = 0;
    for (const auto& view : views) any |= view[v];
    is_hidden[v] = any == faces_it ? 1 : 0;
    found.is_seen[v] = (any & sees_it) != 0 ? 1 : 0;
  }
  for (const Triangle& face : faces) {
    const auto hides = [&](Index v) { return is_hidden[at(v)] != 0; };
    found.is_hidden.push_back(std::ranges::all_of(face, hides) ? 1 : 0);
  }
  found.shares.resize(at(last + 1));
  double sum = 0;
  for (const auto& counted : pixels) {
    for (std::size_t c = 0; c < counted.size(); ++c) {
      found.shares[c] += counted[c];
      sum += counted[c];
    }
  }
  for (double& share : found.shares) share = sum > 0 ? share / sum : 0;
  return found;
}

}  // namespace dynmesh
