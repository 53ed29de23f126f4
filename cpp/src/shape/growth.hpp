/// How large the components are, compared with frame 0, as far as the anchors tell.
#pragma once

#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "shape/model.hpp"

namespace dynmesh {

/// Finds the sizes of the components; see docs/method.md, "Growth". Allocates memory only in the
/// constructor.
class Growth {
 public:
  /// `model` must outlive this object.
  explicit Growth(const ShapeModel& model);

  /// What has to be more than the spread of the edges, to count: the growth since the last frame,
  /// or that since frame 0, if the edges of every frame have errors, which hide a slow growth.
  enum class Since { last_frame, first_frame };
  /// Finds the sizes in a frame, in place of those in the last one, from the edges between known
  /// vertices, whose positions `observed` (k,) holds.
  void find(std::span<const std::uint8_t> known, Field observed, Since since,
            std::span<double> sizes);

 private:
  struct Edge {
    Index a, b;
    double square;  // of the length in frame 0
  };

  [[nodiscard]] double square_of(Index a, Index b, Field frame) const;
  [[nodiscard]] double grown(double from, double last, double rounding);

  const ShapeModel& model_;
  std::vector<std::vector<Edge>> edges_;  // of the components
  // Of one frame and component:
  std::vector<Index> between_anchors_;  // these edges
  std::vector<double> ratios_;          // of the squared lengths of some of them
};

/// Whether any component has another size than in frame 0.
bool any_grown(std::span<const double> sizes);

}  // namespace dynmesh
