/// The fit of modes to a frame: which of the shapes that they span the anchors support.
#pragma once

#include <algorithm>
#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/lender.hpp"
#include "base/workers.hpp"
#include "shape/blend.hpp"
#include "shape/memory.hpp"
#include "shape/modes.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_system.hpp"

namespace dynmesh {

/// A shape that modes add to another one, and what it changes in a frame. All arrays are (k,).
struct AddedShape {
  explicit AddedShape(std::size_t k) : shape(k), wanted(k), steps(k), k_steps(k) {}

  std::vector<Vector3> shape;    ///< B a
  std::vector<Vector3> wanted;   ///< Q B a
  std::vector<Vector3> steps;    ///< Y3, the steps towards it
  std::vector<Vector3> k_steps;  ///< K Y3
  double weight = 0;             ///< k, the part of it that is to be added; 0 without modes

  /// That of coefficients 0.
  void set_zero() {
    for (auto* field : {&shape, &wanted, &steps, &k_steps}) std::ranges::fill(*field, Vector3{});
  }
};

/// Finds coefficients a so that B a, the columns of B being modes, explains a residual r of the
/// frames; see docs/method.md. Without modes, there is no fit, and nothing is allocated.
class ShapeFit {
 public:
  enum class Of {
    /// The rest shape, by modes of a training sequence: m_first + k B a explains what m and m_first
    /// leave unexplained, r = r0 + r1. a continues from frame to frame, and k depends on how much
    /// of it the frames confirm.
    rest,
    /// The change since the last frame, by modes that are learned on the way: m + B a explains what
    /// m leaves unexplained, r = r0. The frames from which they are learned contain the errors of m
    /// where nothing was known, and a rest shape would confirm these; so a begins at 0 in each
    /// frame, and k is 1.
    change
  };

  /// `cells`, `modes` and `workers` must outlive this object. A coefficient that the anchors do not
  /// determine is kept up to `largest_kept`.
  ShapeFit(Of of, const Cells& cells, Workers& workers, double largest_kept, const Modes& modes);

  /// (n,) the coefficients of a memory, as if there were all parts.
  static std::vector<double> no_coefficients() {
    return std::vector<double>(at(modes_of_part * (training_constants.local_parts + 1)));
  }

  [[nodiscard]] bool exists() const { return modes_.size() > 0; }
  /// Fits a to the residuals, from what was remembered, which it replaces. `q` are the rotations of
  /// the residuals.
  Lent<AddedShape> find(const ResidualField& residuals, ShapeFactor& factor, ShapeSystem& system,
                        std::span<const Quaternion> q, FitMemory& memory);
  /// (k,) B a.
  LentField shape_of(const FitMemory& memory);
  /// Lets m_first + `p` take the place of m_first, or m + `p` that of m.
  void add(const Vector3& p, ShapeTerms& to) const {
    if (of_ == Of::change) to.last = to.last + p;
    to.to_rest = of_ == Of::change ? to.to_rest - p : to.to_rest + p;
  }

 private:
  struct Energies {
    double without = 0;  // |r|^2
    double with = 0;     // |r + r3|^2, with the residual r3 of what is added
  };

  /// Numbers for each coefficient.
  struct Coefficients {
    explicit Coefficients(std::size_t n)
        : a(n),
          gradient(n),
          direction(n),
          product(n),
          preconditioned(n),
          squares(n),
          penalties(n),
          shares(n) {}

    std::vector<double> a;  // of B a
    std::vector<double> gradient, direction, product, preconditioned, squares;
    std::vector<double> penalties;  // lambda_j
    std::vector<double> shares;     // g_j
  };

  void combine(const FitMemory& memory, std::span<Vector3> shape);
  Energies measure(const ResidualField& residuals, const AddedShape& added,
                   std::span<Vector3> left) const;
  Lent<std::vector<double>> seen_around(const Anchors& anchors);
  static void penalize(double ratio, Coefficients& of);
  void step_towards(AddedShape& added, ShapeFactor& factor, ShapeSystem& system,
                    std::span<const Quaternion> q);
  double descend(ShapeFactor& factor, ShapeSystem& system, std::span<const Quaternion> q,
                 std::span<Vector3> left, Coefficients& of, AddedShape& added);
  static void update_evidence(const Coefficients& of, FitMemory& memory);
  [[nodiscard]] double variance(const FitMemory& memory) const;
  [[nodiscard]] double prior_weight(const FitMemory& memory, const Anchors& anchors) const;

  Of of_;
  double largest_kept_;
  const Cells& cells_;
  Workers& workers_;
  const Modes& modes_;
  std::size_t size_;  // k, or 0 without modes
  ModeSums sums_;
  Lender<Coefficients> coefficients_;
  Lender<AddedShape> shapes_;
  FieldLender fields_;
  Lender<std::vector<double>> numbers_;
};

}  // namespace dynmesh
