/// The fit of modes to a frame: which of the shapes of a training sequence the anchors support.
#pragma once

#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/blend.hpp"
#include "detail/constants.hpp"
#include "detail/modes.hpp"
#include "detail/rotations.hpp"
#include "detail/shape_system.hpp"
#include "generations/generations.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Finds coefficients a so that m_first + B a, the fitted rest shape, explains what the shapes of
/// the last frame and of frame 0 leave unexplained; see docs/method.md. Without modes, there is no
/// fit, and nothing is allocated.
///
/// With modes that are learned on the way, a is the change since the last frame, so that m + B a
/// explains what m leaves unexplained: the frames from which they are learned contain the errors of
/// m where nothing was known, and a shape that is fitted anew would confirm these.
class ShapeFit {
 public:
  using Field = std::span<const Vector3<double>>;

  ShapeFit(const Cells& cells, Workers& workers, const TrainingConstants& constants,
           bool is_change = false);

  /// Begins a sequence with these modes.
  void reset(Modes modes);

  /// Continues a fit that is a change with other modes of the same parts, which are swapped with
  /// the present ones.
  void replace(Modes& modes);

  [[nodiscard]] bool exists() const { return modes_.size() > 0; }
  [[nodiscard]] const Modes& modes() const { return modes_; }

  /// The number of values in the memory of a fit.
  [[nodiscard]] std::size_t memory_size() const;
  /// What later frames depend on.
  [[nodiscard]] std::vector<double> memory() const;
  /// The same into an array of that size, without allocating memory.
  void store(std::span<double> memory) const;
  /// Whether a fit can have this memory.
  [[nodiscard]] bool accepts(std::span<const double> memory) const;
  void recall(std::span<const double> memory);

  /// What a frame says about the coefficients.
  struct Found {
    double prior_weight = 0;  ///< k, 0 to 1
    double prior_share = 0;   ///< the share of |r0 + r1|^2, or of |r0|^2, that the modes explain
    bool is_first = false;    ///< whether this is the first frame
    Field steps;              ///< (k,) Y3, the step that the modes add
    Field k_steps;            ///< (k,) K Y3
    Field wanted;             ///< (k,) Q B a
  };

  /// Fits a to the residuals and updates the evidence. `rotations` are those of the residuals. The
  /// result is valid until the next call.
  Found find(const ResidualField& residuals, ShapeSystem& system, const Rotations& rotations,
             const Generations& generations);

  /// B a: (k,).
  [[nodiscard]] Field shape() const { return shape_; }
  /// Whether it is added to the shape of the last frame, and not to that of frame 0.
  [[nodiscard]] bool is_change() const { return is_change_; }

 private:
  struct Energies {
    double without = 0;  // |r0 + r1|^2, or |r0|^2 of a change
    double with = 0;     // with r3 added
  };

  void begin();
  [[nodiscard]] double variance() const;
  Energies measure(const ResidualField& residuals);
  void weigh_seen(const Generations& generations);
  void penalize(double ratio);
  [[nodiscard]] double expected(std::size_t coefficient) const;
  double descend(const Anchors& anchors, ShapeSystem& system, const Rotations& rotations);
  [[nodiscard]] bool are_plausible(std::span<const double> coefficients) const;
  void forget();
  void update_evidence();
  void step_towards(Field wanted, const Anchors& anchors, ShapeSystem& system,
                    std::vector<Vector3<double>>& steps, std::vector<Vector3<double>>& k_steps);

  const Cells& cells_;
  Workers& workers_;
  const TrainingConstants& constants_;
  bool is_change_;
  Modes modes_;
  std::vector<double> coefficients_;  // a
  double residual_variance_ = -1;     // sigma^2; negative before the first frame
  double size_ = 0;                   // N_v, the evidence: the squared coefficients,
  double determined_ = 0;             // D_v, and how many of them were determined
  std::vector<double> gradient_, direction_, product_, preconditioned_, squares_;
  std::vector<double> penalties_;  // lambda_j
  std::vector<double> shares_;     // g_j
  std::vector<double> seen_, averaged_;
  std::vector<Vector3<double>> shape_, wanted_, steps_, k_steps_;
  std::vector<Vector3<double>> residual_;  // r0 + r1 + r3, 0 where vertices do not count
  std::vector<Vector3<double>> mode_shape_, mode_wanted_, mode_steps_, mode_k_steps_;
};

}  // namespace dynmesh
