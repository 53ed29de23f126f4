#include "surface_fit/surface_errors.hpp"

#include <algorithm>

#include "shape/shape_system.hpp"
#include "surface_fit/plane_anchors.hpp"

namespace dynmesh {
namespace {

/// The membrane of cloth holds it where it has no points, and the equations of the ensemble leave
/// it out: residuals then do not show what they are due to.
AnchorNoise noise_of_points(std::span<const Material> materials) {
  const bool any_slides = std::ranges::any_of(materials, &Material::slides);
  return any_slides ? AnchorNoise::by_weight : AnchorNoise::of_planes;
}

}  // namespace

SurfaceErrors::SurfaceErrors(const ShapeModel& model, std::span<const Material> materials,
                             Lender<MaskedFactor>& factors, const TrackingConstants& constants,
                             Workers& workers, bool are_wanted)
    : model_(model),
      factors_(factors),
      constants_(constants),
      workers_(workers),
      bars_(model.topology.cells, workers, are_wanted, noise_of_points(materials)) {}

void SurfaceErrors::measure(const FittedSurface& found, bool is_lost, const Memory& memory,
                            Memory& next) {
  if (!bars_.exist()) return;
  auto [anchors, normals] = PlaneAnchors(found.rows, found.x, model_.topology);
  if (!anchors.any_solved()) {
    bars_.pass(next.generations, model_.clusters(), memory.errors, next.errors);
    return;
  }
  ShapeSystem system(model_.k, workers_);
  system.take_planes(constants_.solution.steps);
  ShapeFactor factor(anchors, factors_.lend());
  std::vector<Vector3> kx(model_.size());
  system.apply(found.x, 1, kx);
  anchors.normals = normals;
  bars_.update({found.x, kx, found.shape, model_.rounding.mean_square(found.x)}, factor,
               next.generations, system, model_.clusters(), memory.errors, next.errors);
  const double widest = constants_.radius * model_.mean_edge;
  const double unseen = is_lost ? distance_of_far(found.points, widest) : 0;
  ErrorBars::widen(next.generations, unseen, next.errors);
}

}  // namespace dynmesh
