/// Where the shape changes more than elsewhere.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"
#include "detail/detail_operator.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Squares of residuals, or sums of them over earlier frames, each weighted less than the next.
struct Energy {
  double found = 0;     ///< of the residuals of the frames
  double expected = 0;  ///< of the residuals of the ensemble
  void add(const Energy& newest, double kept) {
    found = kept * found + newest.found;
    expected = kept * expected + newest.expected;
  }
  [[nodiscard]] double ratio() const { return expected > 0 ? found / expected : 0; }
};

/// The size of the changes around each vertex, compared with the mean, which tells busy parts from
/// quiet ones: the root of the ratio of the energies found and expected there in recent frames,
/// closer to 1 where there is little energy to tell. Allocates memory only in `allocate`.
class ChangeSizes {
 public:
  /// `constants` must outlive this object.
  explicit ChangeSizes(const UncertaintyConstants& constants) : constants_(constants) {}
  void allocate(std::size_t n_vertices);
  void reset();

  [[nodiscard]] double of_vertex(std::size_t v) const { return sizes_[v]; }

  /// Adds a frame. `energies` are those at each vertex, found in x and expected in y, for changes
  /// of the current sizes; they are overwritten. `smoother` averages a field with the neighbours.
  void learn(std::span<Vector3<double>> energies, const DetailOperator& smoother, Workers& workers);

  /// The energies around each vertex, as if all sizes were 1; later sizes depend on nothing else.
  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    for (auto& energy : self.energies_) {
      visit(energy.found);
      visit(energy.expected);
    }
  }
  /// Ends reading them: finds the sizes.
  void find(Workers& workers);

 private:
  template <class Work>
  void for_each_vertex(Workers& workers, const Work& work);

  const UncertaintyConstants& constants_;
  std::vector<Energy> energies_;
  std::vector<double> sizes_;
  std::vector<Vector3<double>> averaged_;  // of one frame
};

}  // namespace dynmesh
