/// Whether a completed frame is good, judged by the lengths of its edges.
#pragma once

#include <cstddef>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "shape/memory.hpp"

namespace dynmesh {

/// The limits by which completed frames are judged. In parentheses stands the largest value of
/// people, animals, faces, cloth and water, of which a tenth or more is known, or what one camera
/// sees, and which move fast or jump.
struct CompletionLimits {
  /// A frame is ruined if a larger share of its edges, or of those at anchors, is `times` as long
  /// or as short as in frame 0 (0.03). If a tenth of the vertices lies at the origin, 0.17 are.
  double ruined_share = 0.1;
  double times = 4;
  /// Of a mean edge of frame 0. It is added to all lengths, so that short edges may change by more.
  double added = 0.1;
  /// It is doubtful if a larger share is so many times as long or short, as where vertices have
  /// exchanged their places (0.002, of noise).
  double torn_share = 0.005;
  double torn_times = 8;

  /// Frame 0 does not fit the frames if most edges at anchors have changed since it by more than
  /// this share of their length, and by `steps` times as much as from each of the first frames to
  /// the next, added up (0.18, but 1.6 times as much). A pose changes few edges, another subject
  /// all.
  double misfit = 0.12;
  double steps = 2.3;
  double clear_misfit = 0.5;  ///< in the first frame, before there are any steps (0.35, of noise)
  Index judged_frames = 4;    ///< later, the subject may have changed
  Index agreeing_frames = 3;  ///< in a row, after which ruined frames are of another subject
  std::size_t fewest = 50;    ///< edges at anchors from which anything is concluded
  /// Its vertices are in another order if the distances between at least so many anchors have
  /// changed, by the median, by more than this share more or less than usual (0.43).
  std::size_t fewest_anchors = 10;
  double scattered = 0.57;
  /// It is mirrored if a reflection leaves less than this share of the squared distances that the
  /// best rotation leaves (0.155, of a walking figure, half a step later, of which one camera sees
  /// one side), unless the anchors are nearly in a plane, as of a sheet whose other side bulges
  /// now: across it, they spread less than this share of what they do along it, squared.
  double reflected = 0.1;
  double thickness = 0.01;
  /// A frame is mirrored since the one before if it departs from it by `steps` times as much as
  /// usual, and its reflection does not, but less than this share of it (0.53, of a running
  /// figure). It is of another subject if most edges between vertices that are known in both have
  /// changed by more than `misfit`, and by as much as in so many usual steps, which may have been
  /// dropped, unless all have changed by the same factor, but for `scatter` and `steps` times what
  /// is usual.
  double reflected_step = 0.2;
  double dropped = 12;
  double scatter = 0.02;
  Index usual_steps = 3;    ///< from which on it is known what is usual
  Index recent_steps = 10;  ///< which tell it
  /// Poses change the size by less, as the root mean square distance from the centre.
  double other_size = 1.5;
};

/// Judges the frames of one sequence by some of the edges, so few that it takes at most a fiftieth
/// of the time of a frame. Allocates memory only in the constructor.
class CompletionQuality {
 public:
  /// `topology` must outlive this object.
  CompletionQuality(const Topology& topology, Field first_frame);

  /// Sets `quality` and `reason` in the report of the next frame, which is completed, and the
  /// checks of frame 0 and of the step, which are those of the frame before so far. Later frames do
  /// not follow from a ruined one.
  void judge(const Memory& memory, Memory& next, FrameReport& report);
  /// Sets `quality` and `reason` in the report of a frame that was judged before, by its check.
  void describe(const Memory& memory, FrameReport& report);

 private:
  using Generation = std::span<const Index>;

  struct Edge {
    Index a;
    Index b;
    double shortest;  // squares of the lengths in mean edges between which it is in range
    double longest;
    double shortest_whole;  // the same within which it is not torn
    double longest_whole;
  };

  /// Of all edges, or of those at anchors if it is larger.
  struct Shares {
    double out_of_range = 0;
    double torn = 0;
  };

  /// Shares of the squared size; what a reflection leaves of a flat surface does not count.
  struct Residuals {
    double turned = 0;
    double reflected = 1;
  };

  [[nodiscard]] double square_of(const Edge& edge, Field frame) const;
  [[nodiscard]] double length_of(const Edge& edge, Field frame) const;
  void choose_anchors(Generation generation);
  void leave_out(const Memory& memory, Memory& next);
  void check_first_frame(const Memory& memory, const Memory& next, FirstFrameCheck& check);
  void check_step(const Memory& memory, const Memory& next, StepCheck& check);
  [[nodiscard]] Residuals residuals_of(Field from, Field to) const;
  [[nodiscard]] static bool is_mirrored_step(const Residuals& left, const StepCheck& check);
  [[nodiscard]] bool is_mirrored(Field from, Field to, double share) const;
  [[nodiscard]] Shares shares_of(const Memory& memory) const;
  template <class Counts>
  double change_of(Field from, Field to, const Counts& counts);
  double change_at_anchors(Generation generation, Field from, Field to);
  double change_between(const Memory& memory, const Memory& next);
  double median_change_from(double ratio);
  double scatter_of_ratios();
  bool is_scattered(Field frame);

  const Topology& topology_;
  Field first_frame_;
  double per_edge_;  // mean edges of frame 0 in a unit of length
  std::vector<Edge> edges_;
  // Of a frame:
  std::vector<double> ratios_;  // of lengths to earlier ones
  std::vector<double> changes_;
  std::vector<Index> anchors_;  // some of them, spread evenly
  double flat_share_ = 0;       // of the edges without a length in frame 0
};

}  // namespace dynmesh
