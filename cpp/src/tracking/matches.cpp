#include "tracking/matches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/geometry.hpp"
#include "tracking/cloth.hpp"
#include "tracking/robust_size.hpp"
#include "tracking/vertex_normals.hpp"

namespace dynmesh {
namespace {

/// (components,) -1 if the faces of a component are wound such that they enclose a negative volume.
std::vector<double> find_outsides(std::span<const Triangle> faces, const Topology& topology,
                                  std::span<const Vector3<double>> frame, double mean_edge) {
  const auto component = [&](Index v) {
    return static_cast<std::size_t>(topology.component[static_cast<std::size_t>(v)]);
  };
  std::vector<double> volumes(topology.report.components);
  std::vector<Vector3<double>> origins(volumes.size());
  for (std::size_t v = frame.size(); v-- > 0;) origins[component(static_cast<Index>(v))] = frame[v];
  for (const Triangle& face : faces) {
    const std::size_t c = component(face[0]);
    const auto arm = [&](std::size_t s) {
      return (1 / mean_edge) * (frame[static_cast<std::size_t>(face[s])] - origins[c]);
    };
    volumes[c] += dot(arm(0), cross(arm(1), arm(2)));
  }
  for (double& volume : volumes) volume = volume < 0 ? -1 : 1;
  return volumes;
}

/// The numbers of points in an order in which neighbours are near (Morton 1966), so that their
/// places are near in memory as well.
std::vector<std::uint32_t> along_curve(std::span<const Vector3<double>> points, double cell) {
  Vector3<double> least = points.empty() ? Vector3<double>{} : points[0];
  for (const auto& p : points) {
    least = {std::min(least.x, p.x), std::min(least.y, p.y), std::min(least.z, p.z)};
  }
  constexpr int bits = 10;
  const auto spread = [&](double coordinate) {
    const auto number = static_cast<std::uint32_t>(std::min(coordinate / cell, 1023.0));
    std::uint32_t spaced = 0;
    for (int bit = 0; bit < bits; ++bit) spaced |= (number >> bit & 1U) << (3 * bit);
    return spaced;
  };
  std::vector<std::uint64_t> keys(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto p = points[i] - least;
    const std::uint64_t code = spread(p.x) | spread(p.y) << 1U | spread(p.z) << 2U;
    keys[i] = code << 32U | i;
  }
  std::ranges::sort(keys);
  std::vector<std::uint32_t> order(points.size());
  for (std::size_t r = 0; r < order.size(); ++r) order[r] = static_cast<std::uint32_t>(keys[r]);
  return order;
}

}  // namespace

Matches::Matches(std::span<const Triangle> faces, const Topology& topology, Workers& workers,
                 const TrackingConstants& constants)
    : faces_(faces),
      topology_(topology),
      workers_(workers),
      constants_(constants),
      is_sheet_(find_sheets(faces, topology.component)),
      is_cloth_(topology.cells.size()),
      places_(faces),
      normals_(topology.cells.size()) {
  find_boundaries();
}

void Matches::find_boundaries() {
  is_boundary_.resize(3 * faces_.size());
  at_boundary_.resize(normals_.size());
  const auto edges = boundary_edges(faces_);
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    for (std::size_t s = 0; s < 3; ++s) {
      const Index a = faces_[f][(s + 1) % 3];
      const Index b = faces_[f][(s + 2) % 3];
      const std::array<Index, 2> edge = {std::min(a, b), std::max(a, b)};
      if (!std::ranges::binary_search(edges, edge)) continue;
      is_boundary_[3 * f + s] = 1;
      at_boundary_[static_cast<std::size_t>(a)] = at_boundary_[static_cast<std::size_t>(b)] = 1;
    }
  }
}

bool Matches::is_on_boundary(const Place& place) const {
  const auto n_zero = std::ranges::count(place.shares, 0.0);
  if (n_zero == 2) return at_boundary_[place.nearest_corner()] != 0;
  const auto zero = std::ranges::find(place.shares, 0.0) - place.shares.begin();
  return n_zero == 1 && is_boundary_[3 * place.face + static_cast<std::size_t>(zero)] != 0;
}

/// Draws the boundary of cloth to where the points end: outwards to those whose nearest place is on
/// it, and inwards where it lies beyond the last of them.
void Matches::draw_boundaries(Field x, std::size_t n_points) {
  auto& rows = rows_.rows;
  conormals_.assign(x.size(), {});
  outermost_.assign(x.size(), -std::numeric_limits<double>::infinity());
  for (std::size_t v = 0; v < x.size(); ++v) {
    if (is_cloth_[v] == 0 || at_boundary_[v] == 0) continue;
    Vector3<double> sum;
    for (const Index other : topology_.cells[static_cast<Index>(v)]) {
      sum = sum + (x[v] - x[static_cast<std::size_t>(other)]);
    }
    sum = (1 / mean_edge_) * (sum - dot(sum, normals_[v]) * normals_[v]);
    const double length = std::sqrt(squared_norm(sum));
    if (length > constants_.least_outward) conormals_[v] = (1 / length) * sum;
  }
  beyond_.assign(x.size(), 0.0);
  const auto along = [&](const SurfaceRow& row) {
    const auto offset = row.point - row.on(x);
    return offset - dot(offset, row.normal) * row.normal;
  };
  for (std::size_t r = 0; r < n_points; ++r) {
    const SurfaceRow& row = rows[r];
    if (is_cloth_[row.corners[0]] == 0) continue;
    const auto place = row.on(x);
    for (std::size_t s = 0; s < 3; ++s) {
      const auto v = row.corners[s];
      if (at_boundary_[v] == 0) continue;
      outermost_[v] = std::max(outermost_[v], dot(conormals_[v], place - x[v]) / mean_edge_);
      if (ends_at_[r] == 0 || row.shares[s] == 0) continue;
      beyond_[v] = std::max(beyond_[v], std::sqrt(squared_norm(along(row))) / mean_edge_);
    }
  }
  // Where the points go on farther, it is the template that ends, as at a cut limb.
  const auto ends = [&](std::uint32_t v) { return beyond_[v] < constants_.farthest_end; };
  for (std::size_t r = 0; r < n_points; ++r) {
    SurfaceRow row = rows[r];
    if (ends_at_[r] == 0 || is_cloth_[row.corners[0]] == 0) continue;
    const auto outwards = along(row);
    const double length = std::sqrt(squared_norm(outwards));
    bool is_end = length > 0;
    for (std::size_t s = 0; s < 3; ++s) {
      is_end = is_end && (row.shares[s] == 0 || ends(row.corners[s]));
    }
    if (!is_end) continue;
    row.normal = (1 / length) * outwards;
    row.weight *= constants_.boundary_weight;
    rows.push_back(row);
  }
  for (std::uint32_t v = 0; v < x.size(); ++v) {
    const double beyond = outermost_[v];
    if (!(beyond > -constants_.farthest_overshoot) || !(beyond < -constants_.least_overshoot))
      continue;
    SurfaceRow row;
    row.corners = {v, v, v};
    row.normal = conormals_[v];
    row.point = x[v] + mean_edge_ * (beyond + constants_.least_overshoot) * conormals_[v];
    row.weight = constants_.boundary_weight;
    rows.push_back(row);
  }
}

void Matches::reset(Field first_frame, double mean_edge, std::span<const std::uint8_t> is_cloth,
                    const Clusters& clusters) {
  outside_ = find_outsides(faces_, topology_, first_frame, mean_edge);
  places_.divide(first_frame);
  mean_edge_ = mean_edge;
  std::ranges::copy(is_cloth, is_cloth_.begin());
  any_cloth_ = std::ranges::count(is_cloth, 1) > 0;
  clusters_ = &clusters;
}

void Matches::begin(const PointScan& measurement) {
  measurement_ = &measurement;
  found_.assign(measurement.size(), {});
  order_ = along_curve(measurement.points, mean_edge_);
}

void Matches::find_normals(Field x) {
  find_vertex_normals(faces_, x, normals_);
  for (std::size_t v = 0; v < x.size(); ++v) {
    normals_[v] = outside_[static_cast<std::size_t>(topology_.component[v])] * normals_[v];
  }
}

/// The normal of the surface at a place, on the side of that of the point; 0 if they disagree.
Vector3<double> Matches::agreeing_normal(const Place& place, std::size_t point) const {
  auto normal = place.on(normals_);
  const double length = std::sqrt(squared_norm(normal));
  if (!(length > 0)) return {};
  double cosine = dot(normal, measurement_->normal(point)) / length;
  const bool is_either = is_sheet_[place.corners[0]] != 0 || measurement_->is_undecided(point);
  if (is_either && cosine < 0) {
    normal = -1.0 * normal;
    cosine = -cosine;
  }
  return cosine > constants_.agreement ? (1 / length) * normal : Vector3<double>{};
}

/// Finds the nearest places of all points. A place on the triangle of the last search, or on that
/// of the point before on the curve, bounds the next search.
void Matches::find_places(Field x, const Search& search) {
  const double squared_radius = search.radius * search.radius * mean_edge_ * mean_edge_;
  places_.follow(x);
  workers_.for_each_short_chunk(static_cast<Index>(order_.size()), [&](Index first, Index last) {
    Place before;
    for (auto r = static_cast<std::size_t>(first); r < static_cast<std::size_t>(last); ++r) {
      const std::size_t i = order_[r];
      const auto point = measurement_->point(i);
      Place& place = found_[i];
      Place within = {.squared = squared_radius};
      if (const Place& known = place.any() ? place : before; known.any()) {
        const Place near = places_.place_on(x, known.face, point);
        if (near.squared < within.squared) within = near;
      }
      place = places_.nearest(x, point, within, [](const Place&) { return true; });
      if (!(place.squared < squared_radius)) place = {};
      if (place.any()) before = place;
    }
  });
}

SurfaceRows& Matches::find(Field x, const Search& search) {
  find_normals(x);
  const PointScan& measurement = *measurement_;
  const double radius = search.radius * mean_edge_;
  const double near = constants_.near * mean_edge_;
  find_places(x, search);
  auto& rows = rows_.rows;
  rows.assign(measurement.size(), {});
  distances_.resize(measurement.size());
  ends_at_.assign(measurement.size(), 0);
  workers_.for_each_in_chunks(measurement.size(), [&](std::size_t r) {
    const std::size_t i = order_[r];
    Place place = found_[i];
    if (!place.any()) return;
    auto normal = agreeing_normal(place, i);
    const auto point = measurement.point(i);
    if (squared_norm(normal) == 0 && place.squared > near * near) {
      // Something else is nearer, as the other side of a thin limb is.
      place = places_.nearest(x, point, {.squared = radius * radius}, [&](const Place& other) {
        return squared_norm(agreeing_normal(other, i)) > 0;
      });
      if (!(place.squared < radius * radius)) return;
      normal = agreeing_normal(place, i);
    }
    if (squared_norm(normal) == 0) return;
    auto mean = measurement.normal(i);
    if (dot(mean, normal) < 0) mean = -1.0 * mean;
    mean = mean + normal;
    SurfaceRow& row = rows[r];
    row.corners = place.corners;
    row.shares = place.shares;
    row.normal = (1 / std::sqrt(squared_norm(mean))) * mean;
    row.point = point;
    row.weight = 1;
    distances_[r] = static_cast<float>(std::sqrt(place.squared) / mean_edge_);
    ends_at_[r] = is_on_boundary(place) ? 1 : 0;
  });
  std::size_t n = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].weight == 0) continue;
    rows[n] = rows[i];
    distances_[n] = distances_[i];
    ends_at_[n] = ends_at_[i];
    ++n;
  }
  rows.resize(n);
  distances_.resize(n);
  weigh(x, search);
  rows_.index(x.size());
  return rows_;
}

/// Points that are denser than the vertices count together as much as these.
void Matches::weigh(Field x, const Search& search) {
  auto& rows = rows_.rows;
  if (search.scale == 0) find_usual_distances();
  std::vector<std::uint8_t> touched(normals_.size());
  std::vector<double> sums(topology_.report.components);
  const auto component = [&](const SurfaceRow& row) {
    return static_cast<std::size_t>(topology_.component[row.corners[0]]);
  };
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto v = rows[r].nearest_corner();
    const bool is_usual = search.scale == 0;
    const double ratio =
        static_cast<double>(distances_[r]) /
        (is_usual ? usual_[static_cast<std::size_t>(clusters_->of_vertex[v])] : search.scale);
    const double far = 1 + ratio * ratio;
    rows[r].weight = 1 / (is_usual ? far * far : far);
    sums[component(rows[r])] += rows[r].weight;
    for (const auto corner : rows[r].corners) touched[corner] = 1;
  }
  if (any_cloth_ && search.scale == 0) draw_boundaries(x, rows.size());
  std::erase_if(rows,
                [&](const SurfaceRow& row) { return sums[component(row)] < constants_.fewest; });
  const double density = std::min(1.0, static_cast<double>(std::ranges::count(touched, 1)) /
                                           static_cast<double>(std::max(rows.size(), 1UL)));
  for (SurfaceRow& row : rows) {
    row.weight *= density * (is_cloth_[row.corners[0]] != 0 ? search.cloth_weight : search.weight);
  }
}

double Matches::distance_of(double share) const {
  return distances_.empty() ? 0 : quantile({distances_.begin(), distances_.end()}, share);
}

/// The distance at which points count half: where the surface has not arrived yet, all are far, and
/// where it has, those that are far are of something else.
void Matches::find_usual_distances() {
  const auto& rows = rows_.rows;
  const std::size_t n_clusters = clusters_->size();
  const auto cluster_of = [&](const SurfaceRow& row) {
    return static_cast<std::size_t>(clusters_->of_vertex[row.nearest_corner()]);
  };
  ends_.assign(n_clusters + 1, 0);
  for (const SurfaceRow& row : rows) ++ends_[cluster_of(row) + 1];
  for (std::size_t c = 0; c < n_clusters; ++c) ends_[c + 1] += ends_[c];
  std::vector<float> sorted(rows.size());
  auto next = ends_;
  for (std::size_t r = 0; r < rows.size(); ++r) sorted[next[cluster_of(rows[r])]++] = distances_[r];
  usual_.resize(n_clusters);
  std::vector<float> around;
  for (std::size_t c = 0; c < n_clusters; ++c) {
    around.assign(sorted.begin() + ends_[c], sorted.begin() + ends_[c + 1]);
    for (const Index other : clusters_->neighbours[static_cast<Index>(c)]) {
      const auto o = static_cast<std::size_t>(other);
      around.insert(around.end(), sorted.begin() + ends_[o], sorted.begin() + ends_[o + 1]);
    }
    double median = 0;
    if (!around.empty()) {
      const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
      std::ranges::nth_element(around, middle);
      median = static_cast<double>(*middle);
    }
    usual_[c] = std::clamp(constants_.usual_distances * median, constants_.least_scale,
                           constants_.largest_scale);
  }
}

}  // namespace dynmesh
