/// The fit of modes to a frame: which of the shapes that they span the anchors support.
#pragma once

#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/blend.hpp"
#include "shape/modes.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_library.hpp"
#include "shape/shape_system.hpp"

namespace dynmesh {

/// A shape that modes add to another one, and what it changes in a frame. All arrays are (k,).
struct AddedShape {
  std::vector<Vector3<double>> shape;    ///< B a
  std::vector<Vector3<double>> wanted;   ///< Q B a
  std::vector<Vector3<double>> steps;    ///< Y3, the steps towards it
  std::vector<Vector3<double>> k_steps;  ///< K Y3

  /// That of coefficients 0.
  void set_zero(std::size_t k) {
    for (auto* field : {&shape, &wanted, &steps, &k_steps}) field->assign(k, {});
  }
};

/// What a frame says about the coefficients.
struct FittedModes {
  double prior_weight = 1;  ///< k, 0 to 1
  double prior_share = 0;   ///< the share of |r|^2 that the modes explain
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

  /// `cells` and `workers` must outlive this object. A coefficient that the anchors do not
  /// determine is kept up to `largest_kept`.
  ShapeFit(Of of, const Cells& cells, Workers& workers, double largest_kept, Modes modes);

  /// Continues with the modes of these shapes.
  void learn(ShapeLibrary& library);

  [[nodiscard]] const Modes& modes() const { return modes_; }
  [[nodiscard]] bool exists() const { return modes_.size() > 0; }
  /// Fits a to the residuals. `rotations` are those of the residuals.
  FittedModes find(const ResidualField& residuals, ShapeSystem& system, const Rotations& rotations);
  /// B a, and what it changes in the last frame.
  [[nodiscard]] const AddedShape& added() const { return added_; }
  /// Lets m_first + `p` take the place of m_first, or m + `p` that of m.
  void add(const Vector3<double>& p, ShapeTerms& to) const {
    if (of_ == Of::change) to.last = to.last + p;
    to.to_rest = of_ == Of::change ? to.to_rest - p : to.to_rest + p;
  }

  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    for (auto* of : {&self.residual_variance_, &self.size_, &self.determined_, &self.explained_}) {
      visit(*of);
    }
    if (self.of_ == Of::rest) visit(self.coefficients_);
  }
  /// Ends reading them.
  void recall();

 private:
  struct Energies {
    double without = 0;  // |r|^2
    double with = 0;     // |r + r3|^2, with the residual r3 of what is added
  };

  [[nodiscard]] std::span<double> used() {
    return std::span(coefficients_).first(modes_.n_coefficients());
  }
  void begin();
  void begin_at_zero();
  Energies measure(const ResidualField& residuals);
  void weigh_seen(const Anchors& anchors);
  void penalize(double ratio);
  double descend(const Anchors& anchors, ShapeSystem& system, const Rotations& rotations);
  void update_evidence();
  [[nodiscard]] bool is_plausible() const;
  [[nodiscard]] double variance() const;
  [[nodiscard]] double prior_weight(const Anchors& anchors) const;

  Of of_;
  double largest_kept_;
  const Cells& cells_;
  Workers& workers_;
  Modes modes_;
  std::vector<double> coefficients_;  // a, as if there were all parts
  double residual_variance_ = -1;     // sigma^2; negative before the first frame
  double size_ = 0;                   // N_v, the evidence: the squared coefficients,
  double determined_ = 0;             // D_v, and how many of them were determined
  double explained_ = 0;              // the share of |r|^2 that the modes explain, lately
  std::vector<double> gradient_, direction_, product_, preconditioned_, squares_;
  std::vector<double> penalties_;  // lambda_j
  std::vector<double> shares_;     // g_j
  std::vector<double> seen_, averaged_;
  AddedShape added_, direction_added_;
  std::vector<Vector3<double>> left_;  // r + r3, 0 where vertices do not count
};

}  // namespace dynmesh
