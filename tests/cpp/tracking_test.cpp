/// The surface with which a scan is compared, and steps towards the scan.
#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/geometry.hpp"
#include "base/workers.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "shape/shape_system.hpp"
#include "shared_work.hpp"
#include "surface_fit/correction.hpp"
#include "surface_fit/materials.hpp"
#include "surface_fit/membrane.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/scan_arguments.hpp"
#include "surface_fit/surface_places.hpp"
#include "surface_fit/surface_system.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("the nearest place is that of all triangles, also after the surface has moved") {
  const auto mesh = torus(12);
  const auto faces = triangles_of(mesh);
  const auto first = rows_of(mesh.vertices);
  SurfacePlaces places(faces, first);
  auto x = first;
  for (auto& position : x) position = {position.y, 2 * position.z, -position.x};
  places.update_boxes(x);
  const auto anywhere = [](const Place&) { return true; };
  const auto upwards = [](const Place& place) { return place.face % 2 == 0; };
  for (const auto& point : random_field(200, 5)) {
    Place nearest, nearest_upwards;
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
      const Place place = places.place_on(x, f, point);
      const auto on = place.on(x);
      CHECK(place.squared == doctest::Approx(squared_norm(on - point)));
      for (const auto corner : place.corners) {
        // No corner, nor the middle between it and the place, is nearer.
        CHECK(place.squared <= squared_norm(x[corner] - point) + 1e-12);
        CHECK(place.squared <= squared_norm(0.5 * (on + x[corner]) - point) + 1e-12);
      }
      if (place.squared < nearest.squared) nearest = place;
      if (upwards(place) && place.squared < nearest_upwards.squared) nearest_upwards = place;
    }
    CHECK(places.nearest(x, point, {}, anywhere).squared == nearest.squared);
    CHECK(places.nearest(x, point, {}, upwards).squared == nearest_upwards.squared);
    CHECK(places.nearest(x, point, places.place_on(x, 7, point), anywhere).squared ==
          nearest.squared);
    const Place bound = {.squared = 0.5 * nearest.squared};
    CHECK(places.nearest(x, point, bound, anywhere).squared == bound.squared);
  }
}

TEST_CASE("a walk over a flat surface ends at the nearest place of all") {
  const auto mesh = sheet<double>(12);
  const auto faces = triangles_of(mesh);
  auto x = rows_of(mesh.vertices);
  for (auto& position : x) position.z = 0;
  SurfacePlaces places(faces, x);
  places.update_boxes(x);
  for (const auto& point : random_field(200, 6)) {
    const auto far = 10.0 * point;  // beside it, too
    const Place nearest = places.nearest(x, far, {}, [](const Place&) { return true; });
    CHECK(places.walk(x, far, 11).squared == doctest::Approx(nearest.squared));
  }
}

TEST_CASE("a place on a triangle without area is on one of its sides") {
  const std::vector<Triangle> faces = {{0, 1, 2}, {3, 3, 3}};
  const std::vector<Vector3> x = {{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {5, 0, 0}};
  SurfacePlaces places(faces, x);
  places.update_boxes(x);
  const auto anywhere = [](const Place&) { return true; };
  CHECK(places.nearest(x, {1.5, 2, 0}, {}, anywhere).squared == doctest::Approx(4));
  CHECK(places.nearest(x, {5, 0, 3}, {}, anywhere).squared == doctest::Approx(9));
}

using Field = std::vector<Vector3>;

/// The slope of a quadratic function in random directions, which differences show exactly, over
/// that at 0.
template <class Energy>
double slope_at(const Field& x, const Energy& energy) {
  const auto slope = [&](const Field& from) {
    double sum = 0;
    for (unsigned seed = 4; seed < 8; ++seed) {
      const Field direction = random_field(x.size(), seed);
      Field ahead = from, behind = from;
      for (std::size_t i = 0; i < x.size(); ++i) {
        ahead[i] = from[i] + direction[i];
        behind[i] = from[i] - direction[i];
      }
      sum += std::abs(energy(ahead) - energy(behind));
    }
    return sum;
  };
  return slope(x) / slope(Field(x.size()));
}

/// The slope of |K D - r|^2 + mu D C D + sum_p w_p (n_p . (sum_s b_s D_s - q_p))^2 + sum of w |D_i
/// - D_j|^2 over a tie, and of a landmark, at the steps D towards rows.
double slope_of_rows_after(int steps) {
  const auto mesh = torus(12);
  const std::size_t k = mesh.size();
  Workers workers(1);
  const Topology topology = build_topology(mesh.faces(), k);
  const Field first = rows_of(mesh.vertices);
  const ShapeModel model(topology, triangles_of(mesh), first, {}, 0, workers);
  TrackingConstants constants;
  const std::vector<Tie> ties = {{3, 100, 2.0}};
  const std::vector<Landmark> landmarks = {{7, {1, 2, 3}, 0.4}};
  SurfaceSystem system(model, std::vector<double>(k), constants, ties, workers);
  std::vector<SurfaceRow> rows;
  const Field normals = random_field(2 * k, 1);
  const Field points = random_field(2 * k, 2);
  for (std::uint32_t r = 0; r < 2 * k; ++r) {
    const auto a = r % static_cast<std::uint32_t>(k);
    rows.push_back({{0, {a, (a + 1) % 144, (a + 12) % 144}, {0.5, 0.2, 0.3}},
                    (1 / std::sqrt(squared_norm(normals[r]))) * normals[r],
                    points[r],
                    0.7});
  }
  const Field residual = random_field(k, 3);
  const Pulls pulls = {rows, landmarks, ties};
  auto preconditioner = system.preconditioner(pulls, 1);
  Field force(k);
  const std::vector<double> resistance(k, 1.0);
  system.pull_back(resistance, residual, force);
  Field d(k);
  system.solve(pulls, preconditioner, resistance, {steps, 0}, d, force);
  const auto energy = [&](const Field& x) {
    Field detail(k);
    apply_operator(model.k, x, 1, detail, workers);
    double sum = 2.0 * squared_norm(x[3] - x[100]);
    sum += 0.4 * squared_norm(x[7] - landmarks[0].target);
    for (std::size_t v = 0; v < k; ++v) {
      sum += squared_norm(detail[v] - residual[v]) + constants.hold * squared_norm(x[v]);
    }
    for (const SurfaceRow& row : rows) {
      const double off = dot(row.normal, row.on(x) - row.point);
      sum += row.weight * off * off;
    }
    return sum;
  };
  return slope_at(d, energy);
}

TEST_CASE("steps towards rows end where all rows, ties and shapes balance") {
  CHECK(slope_of_rows_after(400) < 1e-5);
  CHECK(slope_of_rows_after(12) < 0.02);
  CHECK(slope_of_rows_after(0) == doctest::Approx(1));
}

/// A flat square of n by n vertices at distances of 1, around the origin.
Mesh<double> flat_sheet(int n) {
  auto mesh = sheet<double>(n, -0.5 * (n - 1));
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 3) {
    mesh.vertices[v + 1] -= 0.5 * (n - 1);
    mesh.vertices[v + 2] = 0;
  }
  return mesh;
}

std::vector<Material> materials_of(const Mesh<double>& mesh, const Topology& topology) {
  const auto frame = rows_of(mesh.vertices);
  const auto clusters = cluster_vertices(topology.cells, frame);
  return find_materials(triangles_of(mesh), topology, clusters, frame, {});
}

TEST_CASE("sheets that are free to slide are cloth, components one by one") {
  const auto sheet = flat_sheet(12);
  auto hill = flat_sheet(16);  // its shape holds it
  for (std::size_t v = 0; v < hill.vertices.size(); v += 3) {
    const double x = hill.vertices[v] / 7.5;
    const double y = hill.vertices[v + 1] / 7.5;
    hill.vertices[v + 2] =
        12 * std::cos(2 * x) * std::cos(1.5 * y + 0.4 * x) + 4 * std::sin(3 * x * y);
  }
  const auto all = join(join(sheet, bumpy_torus(16)), hill);
  const auto topology = build_topology(all.faces(), all.size());
  const auto materials = materials_of(all, topology);
  CHECK(std::ranges::count(materials, true, &Material::slides) == 1);
  CHECK(materials[0].slides);
}

TEST_CASE("a sheet with wrinkles is cloth on meshes of any resolution") {
  const auto wrinkle = [](double x, double y) {
    return 1.2 * std::sin(2.5 * x) * std::sin(2.9 * y);
  };
  for (const int times : {1, 2, 6}) {
    auto mesh = flat_sheet(23 * times + 1);
    for (std::size_t v = 0; v < mesh.vertices.size(); v += 3) {
      const double x = (mesh.vertices[v] /= times);
      const double y = (mesh.vertices[v + 1] /= times);
      const double left = std::floor(x);
      const double low = std::floor(y);
      mesh.vertices[v + 2] = std::lerp(
          std::lerp(wrinkle(left, low), wrinkle(left + 1, low), x - left),
          std::lerp(wrinkle(left, low + 1), wrinkle(left + 1, low + 1), x - left), y - low);
    }
    const auto topology = build_topology(mesh.faces(), mesh.size());
    CAPTURE(times);
    CHECK(materials_of(mesh, topology)[0].slides);
  }
}

/// The energy of the membrane with mu = 1, as its equation says.
double membrane_energy(const Mesh<double>& mesh, const std::vector<double>& x) {
  const auto at = [](const std::vector<double>& points, Index v) {
    return Eigen::Vector3d(
        Eigen::Map<const Eigen::Vector3d>(&points[3 * static_cast<std::size_t>(v)]));
  };
  double energy = 0;
  for (const Triangle& face : triangles_of(mesh)) {
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    std::array<double, 3> weights{};
    std::array<Eigen::Vector3d, 3> before, now;
    for (std::size_t s = 0; s < 3; ++s) {
      const Index i = face[s];
      const Index j = face[(s + 1) % 3];
      const Eigen::Vector3d apex = at(mesh.vertices, face[(s + 2) % 3]);
      const Eigen::Vector3d a = at(mesh.vertices, i) - apex;
      const Eigen::Vector3d b = at(mesh.vertices, j) - apex;
      weights[s] = 0.5 * a.dot(b) / a.cross(b).norm();
      before[s] = at(mesh.vertices, i) - at(mesh.vertices, j);
      now[s] = at(x, i) - at(x, j);
      covariance += weights[s] * now[s] * before[s].transpose();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
    for (std::size_t s = 0; s < 3; ++s) {
      energy += weights[s] * (now[s] - rotation * before[s]).squaredNorm();
    }
  }
  return energy;
}

TEST_CASE("the membrane pulls down the slope of its energy, and not where cloth only folds") {
  auto mesh = flat_sheet(5);
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 3) {
    mesh.vertices[v] += 0.5 * mesh.vertices[v + 1];  // acute triangles, none of which is flipped
  }
  Workers workers(1);
  Membrane membrane(triangles_of(mesh), rows_of(mesh.vertices), 1,
                    std::vector<double>(mesh.size(), 1.0), workers);
  const auto force_at = [&](const std::vector<double>& x) {
    std::vector<Vector3> forces(mesh.size());
    membrane.add_forces(rows_of(x), forces);
    return forces;
  };
  auto x = turned(mesh.vertices, 0.4);
  for (const auto& force : force_at(x)) CHECK(squared_norm(force) < 1e-24);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += 0.3 * std::sin(5.0 * static_cast<double>(i));
  const auto forces = force_at(x);
  constexpr double step = 1e-5;
  for (std::size_t i = 0; i < x.size(); ++i) {
    auto above = x;
    auto below = x;
    above[i] += step;
    below[i] -= step;
    const double slope = (membrane_energy(mesh, above) - membrane_energy(mesh, below)) / (2 * step);
    const auto& force = forces[i / 3];
    const double found = i % 3 == 0 ? force.x : i % 3 == 1 ? force.y : force.z;
    CHECK(found == doctest::Approx(-0.5 * slope).epsilon(1e-4));
  }
  // Turned by a right angle around a row of edges.
  auto fold = mesh.vertices;
  for (std::size_t v = 0; v < fold.size(); v += 3) {
    if (fold[v + 1] > 0) fold[v + 2] = std::exchange(fold[v + 1], 0.0);
  }
  for (const auto& force : force_at(fold)) CHECK(squared_norm(force) < 1e-24);
}

TEST_CASE("threads share the frames of a tracker of eight thousand vertices") {
  const SharedWork restores_the_default;
  default_task_sharing() = {.patience = 1'000'000};
  const auto mesh = torus(90);
  Tracker<double> tracker(mesh.faces(), mesh.points(), {.threads = 2});
  std::vector<double> out(3 * mesh.size());
  CHECK(shared_pieces([&] { tracker.push({mesh.points()}, {out.data(), mesh.size()}); }) > 0);
}

TEST_CASE("a subject that rests where its points lie stays there, also on a coarse mesh") {
  const auto mesh = bumpy_torus(40);
  const Samples samples = scan_of(mesh, mesh.vertices);
  Tracker<double> tracker(mesh.faces(), mesh.points(), {.resolution = 400});
  std::vector<double> tracked;
  for (int i = 0; i < 10; ++i) tracked = track(tracker, samples);
  double farthest = 0;
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    farthest = std::max(farthest, std::abs(tracked[i] - mesh.vertices[i]));
  }
  const auto positions = rows_of(mesh.vertices);
  const Triangle face = triangles_of(mesh)[0];
  CHECK(farthest < 1e-3 * std::sqrt(squared_norm(positions[face[0]] - positions[face[1]])));
}

/// A torus that turns about its axis shows by its colours alone that it moves.
TEST_CASE("colours tell how a surface slides along itself") {
  const auto mesh = torus(40);
  const auto positions = rows_of(mesh.vertices);
  const Triangle face = triangles_of(mesh)[0];
  const double edge = std::sqrt(squared_norm(positions[face[0]] - positions[face[1]]));
  std::vector<double> colours;
  for (const Vector3& p : positions) {
    colours.insert(colours.end(),
                   {std::sin(3 * p.x + p.y), std::cos(3 * p.y - p.z), std::sin(2 * p.x)});
  }
  const auto error = [&](Index resolution, double change_of_exposure, bool has_colours) {
    Tracker<double> tracker(mesh.faces(), mesh.points(), {.resolution = resolution});
    double off = 0;
    for (int i = 0; i <= 10; ++i) {
      const auto truth = turned(mesh.vertices, 0.02 * i);
      Samples samples = scan_of(mesh, truth);
      if (has_colours) samples.colours = scan_of(mesh, colours).points;
      for (double& colour : samples.colours) colour += change_of_exposure * i;
      const auto tracked = track(tracker, samples);
      off = 0;
      for (std::size_t c = 0; c < tracked.size(); ++c) off += std::abs(tracked[c] - truth[c]);
      off /= static_cast<double>(mesh.size());
    }
    return off / edge;
  };
  CHECK(error(0, 0, false) > 1);
  CHECK(error(0, 0, true) < 0.1);
  CHECK(error(0, 0.1, true) < 0.1);
  CHECK(error(400, 0, true) < 0.6);
}

TEST_CASE("a correction that goes on begins farther, and one that is led back less far") {
  Workers workers(1);
  const TrackingConstants constants;
  const double half_turn = std::sqrt(0.5);
  const std::vector<Quaternion> q(2, {half_turn, 0, 0, half_turn});  // of x to y
  const Field followed = {{5, 0, 0}, {0, 3, 0}};
  const Field up = {{0, 0, 1}, {0, 0, 1}};
  TrackingMemory last;
  last.corrections = {{1, 0, 0}, {1, 0, 0}};
  last.correction_share = 0.5;
  const Correction correction(followed, q, last, constants, workers);
  const auto start = correction.start();
  for (std::size_t v = 0; v < 2; ++v) {
    CHECK(squared_norm(start[v] - followed[v] - Vector3{0, 0.5, 0}) < 1e-20);
  }
  const auto led = [&](const Vector3& way) {
    Field x = {followed[0] + way, followed[1] + way};
    TrackingMemory next = last;
    correction.end(up, q, x, next);
    // Beyond, but not away from the surface.
    const auto beyond = 0.5 * constants.beyond_correction * Vector3{way.x, way.y, 0};
    CHECK(squared_norm(x[0] - followed[0] - way - beyond) < 1e-20);
    CHECK(next.corrections[0].z == doctest::Approx(way.z));
    CHECK(next.corrections[0].x == doctest::Approx((way + beyond).y));
    return next.correction_share;
  };
  CHECK(led({0, 1, 0}) == doctest::Approx(constants.largest_correction));
  CHECK(led({0, 0.5, 2}) == doctest::Approx(0.5));  // nothing more along the last one
  CHECK(led({0, 0.1, 0}) == doctest::Approx(0.5 - constants.correction_growth));
  forget_correction(last);
  const Correction none(followed, q, last, constants, workers);
  CHECK(squared_norm(none.start()[0] - followed[0]) == 0);
}

TEST_CASE("colours of depth images are those of their pixels") {
  const auto mesh = torus(40);
  const auto images = images_of(mesh, mesh.vertices, 2, 60);
  std::vector<std::uint8_t> colours(3UL * 60 * 60);
  std::vector<DepthImage> views;
  for (const Image& image : images) views.push_back(image.view());
  for (std::size_t p = 0; p < 60UL * 60; ++p) colours[3 * p] = static_cast<std::uint8_t>(p % 60);
  views[0].colours = colours.data();
  CHECK_THROWS_WITH_AS(point_scan_of(views, 1, 100000), doctest::Contains("image 1"),
                       std::invalid_argument);
  views[1].colours = colours.data();
  for (const std::size_t most : {100000UL, 200UL}) {
    const PointScan scan = point_scan_of(views, 1, most);
    REQUIRE(scan.colours.size() == scan.size());
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const DepthImage& image = views[scan.sensor_numbers[i]];
      const auto arm = scan.points[i] - Vector3{image.pose[3], image.pose[7], image.pose[11]};
      const double depth = dot(arm, {image.pose[2], image.pose[6], image.pose[10]});
      const double across = dot(arm, {image.pose[0], image.pose[4], image.pose[8]});
      const double column = image.intrinsics[0] * across / depth + image.intrinsics[2];
      CHECK(scan.colours[i].x == doctest::Approx(column).epsilon(0.1));
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
