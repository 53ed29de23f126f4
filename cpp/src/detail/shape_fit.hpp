/// The fit of modes to a frame: which of the shapes that they span the anchors support.
#pragma once

#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <utility>
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

/// A shape that modes add to another one, and what it changes in a frame. All arrays are (k,).
struct AddedShape {
  std::vector<Vector3<double>> shape;    ///< B a
  std::vector<Vector3<double>> wanted;   ///< Q B a
  std::vector<Vector3<double>> steps;    ///< Y3, the steps towards it
  std::vector<Vector3<double>> k_steps;  ///< K Y3
};

/// What a frame says about the coefficients.
struct FittedModes {
  double prior_weight = 1;  ///< k, 0 to 1
  double prior_share = 0;   ///< the share of |r|^2 that the modes explain
  bool is_first = false;    ///< whether this is the first fit of a rest shape
};

/// Finds coefficients a so that B a, the columns of B being modes, explains a residual r of the
/// frames; see docs/method.md. RestFit and ChangeFit say what r is, and where a begins.
class ModeFit {
 public:
  [[nodiscard]] bool exists() const { return modes_.size() > 0; }
  /// B a, and what it changes in the last frame.
  [[nodiscard]] const AddedShape& added() const { return added_; }

 protected:
  using Residual = Vector3<double> (*)(const Residuals&);

  /// `largest_variance` is that of v.
  ModeFit(const Cells& cells, Workers& workers, const TrainingConstants& constants,
          double largest_variance, Residual residual)
      : constants_(constants),
        cells_(cells),
        workers_(workers),
        largest_variance_(largest_variance),
        residual_(residual) {}

  void reset(Modes modes);
  void replace(Modes& modes);

  void begin_at_zero();
  void begin_at_last(const Anchors& anchors, ShapeSystem& system, const Rotations& rotations);
  /// Changes a by what the residuals say, and updates the evidence.
  FittedModes find(const ResidualField& residuals, ShapeSystem& system, const Rotations& rotations,
                   const Generations& generations);

  [[nodiscard]] const TrainingConstants& constants() const { return constants_; }
  [[nodiscard]] bool is_first() const { return residual_variance_ < 0; }
  [[nodiscard]] double variance() const;
  [[nodiscard]] double explained() const { return explained_; }
  [[nodiscard]] double extrapolation() const;
  [[nodiscard]] std::span<const double> coefficients() const { return coefficients_; }
  void recall_coefficients(std::span<const double> coefficients);
  [[nodiscard]] bool are_plausible(std::span<const double> coefficients) const;

  /// The evidence in a memory of a fit: its first numbers.
  static constexpr std::size_t n_evidence = 4;
  void store(std::span<double> memory) const;
  [[nodiscard]] bool accepts(std::span<const double> memory) const;
  void recall(std::span<const double> memory);

 private:
  struct Energies {
    double without = 0;  // |r|^2
    double with = 0;     // |r + r3|^2, with the residual r3 of what is added
  };

  void begin();
  Energies measure(const ResidualField& residuals);
  void weigh_seen(const Generations& generations);
  void penalize(double ratio);
  [[nodiscard]] double expected(std::size_t coefficient) const;
  double descend(const Anchors& anchors, ShapeSystem& system, const Rotations& rotations);
  void update_evidence();

  const TrainingConstants& constants_;
  const Cells& cells_;
  Workers& workers_;
  double largest_variance_;
  Residual residual_;  // r
  Modes modes_;
  std::vector<double> coefficients_;  // a
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

/// Fits the rest shape by modes of a training sequence: m_first + k B a explains what m and m_first
/// leave unexplained, r = r0 + r1. a continues from frame to frame, and k depends on how much of it
/// the frames confirm. Without modes, there is no fit, and nothing is allocated.
class RestFit : public ModeFit {
 public:
  /// The arguments must outlive this object.
  RestFit(const Cells& cells, Workers& workers, const TrainingConstants& constants)
      : ModeFit(cells, workers, constants, constants.largest_variance,
                [](const Residuals& r) { return r.r0 + r.r1; }) {}

  /// Begins a sequence with these modes. If it throws, nothing has changed.
  using ModeFit::reset;

  /// Fits a to the residuals. `rotations` are those of the residuals.
  FittedModes find(const ResidualField& residuals, ShapeSystem& system, const Rotations& rotations,
                   const Generations& generations);
  /// Lets m_first + `p` take the place of m_first.
  static void add(const Vector3<double>& p, ShapeTerms& to) { to.to_rest = to.to_rest + p; }

  /// The number of values in a memory, which is what later frames depend on.
  [[nodiscard]] std::size_t memory_size() const;
  void store(std::span<double> memory) const;
  /// Whether `store` can have stored these.
  [[nodiscard]] bool accepts(std::span<const double> memory) const;
  void recall(std::span<const double> memory);
};

/// Fits the change since the last frame by modes that are learned on the way: m + B a explains what
/// m leaves unexplained, r = r0. The frames from which they are learned contain the errors of m
/// where nothing was known, and a rest shape would confirm these; so a begins at 0 in each frame.
class ChangeFit : public ModeFit {
 public:
  /// There is no fit until `modes`, which are zero, are replaced. The other arguments must outlive
  /// this object.
  ChangeFit(const Cells& cells, Workers& workers, const TrainingConstants& constants, Modes modes)
      : ModeFit(cells, workers, constants, constants.least_variance,
                [](const Residuals& r) { return r.r0; }) {
    reset(std::move(modes));
  }

  /// Continues with other modes of the same parts, which are swapped with the present ones.
  using ModeFit::replace;

  /// Fits a to the residuals. `rotations` are those of the residuals.
  FittedModes find(const ResidualField& residuals, ShapeSystem& system, const Rotations& rotations,
                   const Generations& generations) {
    begin_at_zero();
    return ModeFit::find(residuals, system, rotations, generations);
  }
  /// Lets m + `p` take the place of m.
  static void add(const Vector3<double>& p, ShapeTerms& to) {
    to.last = to.last + p;
    to.to_rest = to.to_rest - p;
  }

  /// The memory, as of RestFit.
  static constexpr std::size_t memory_size = n_evidence;
  using ModeFit::accepts;
  using ModeFit::recall;
  using ModeFit::store;
};

}  // namespace dynmesh
