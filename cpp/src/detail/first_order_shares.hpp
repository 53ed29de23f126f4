/// How much of the first-order step each component takes, by what it predicts of anchors left out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"
#include "generations/generations.hpp"
#include "support/stored_numbers.hpp"

namespace dynmesh {

/// Decides in which frames anchors are left out, and which, and chooses the shares by the errors of
/// both predictions. Components that have shown little so far form one group with a common share;
/// each of the others is a group of its own.
///
/// Allocates memory only in the constructor and in `read_memory`. All sums run in the order of the
/// vertices, so they are the same for any number of threads.
class FirstOrderShares {
 public:
  using Field = std::span<const Vector3<double>>;

  /// Both must outlive this object.
  FirstOrderShares(const Topology& topology, const FirstOrderConstants& constants);
  void reset();

  /// Counts a frame. Called once for each frame after frame 0.
  void count_frame() { ++frame_; }

  /// Whether this frame is to be tested: every `gap`th, and before these frames 1, 2, 4 and so on,
  /// since nothing is known yet.
  [[nodiscard]] bool is_due() const;

  /// Draws the anchors to leave out and sets `is_left_out` (k,). Returns false if there are none.
  bool draw(const Generations& generations, std::span<std::uint8_t> is_left_out);

  /// How many edges around an anchor that `draw` has left out are worth moving.
  [[nodiscard]] int rings_around(std::size_t v) const;

  /// Chooses the shares by the predictions of the anchors left out and their `observed` positions.
  /// Errors are in the unit of the positions; those below `rounding` count as 0.
  void learn(Field detail, Field first_order, Field observed,
             std::span<const std::uint8_t> is_left_out, double rounding);

  /// The share at a vertex, from 0 to 1.
  [[nodiscard]] double of_vertex(std::size_t v) const;
  [[nodiscard]] double largest() const;

 private:
  static constexpr std::size_t n_shares = 10;  // 0.1, 0.2, ... 1; a share of 0 gains nothing

  /// How much smaller the errors are with each share than with detail alone.
  struct Gains {
    std::array<double, n_shares> sums{};
    std::array<double, n_shares> squares{};
    double size = 0;   // the sum of the errors of detail
    double count = 0;  // the number of errors

    void add(const Gains& other, double kept = 1);
  };
  struct Component {
    Gains gains;  // of earlier tests, the less the older
    double share = 0;
  };

 public:
  /// What later frames depend on.
  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    for (auto& [gains, share] : self.components_) {
      for (auto& sum : gains.sums) visit(sum);
      for (auto& square : gains.squares) visit(square);
      visit(gains.size);
      visit(gains.count);
      visit(share);
    }
    visit(self.frame_);
  }

 private:
  struct Drawn {
    double anchors = 0;
    double left_out = 0;
  };

  [[nodiscard]] std::size_t component_of(std::size_t v) const {
    return static_cast<std::size_t>(topology_.component[v]);
  }
  [[nodiscard]] std::size_t group_of(std::size_t component) const;
  [[nodiscard]] double probability_of(const Drawn& component) const;
  [[nodiscard]] double best_share(const Gains& gains, const Gains& newest) const;

  const Topology& topology_;
  const FirstOrderConstants& constants_;
  std::vector<double> sizes_;  // of the components, in vertices
  std::vector<Component> components_;
  std::uint64_t frame_ = 0;  // since frame 0

  // Of one frame. Group 0 is the common one, group c + 1 is component c:
  std::vector<Drawn> drawn_;
  std::vector<Gains> newest_, of_groups_, newest_of_groups_;
};

}  // namespace dynmesh
