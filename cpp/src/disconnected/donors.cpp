#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <numeric>

#include "disconnected/disconnected.hpp"

namespace dynmesh {
namespace {

/// A k-d tree. Each node stores whether all of its vertices belong to one component; otherwise a
/// search from inside a large component would visit all of that component first.
template <class Real>
class ComponentTree {
 public:
  ComponentTree(std::span<const Vector3<Real>> frame, std::span<const Index> component)
      : frame_(frame), component_(component), order_(frame.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    build(0, order_.size());
  }

  /// Returns the nearest vertex that is not in the component of `vertex`, or -1.
  [[nodiscard]] Index nearest(Index vertex) const {
    Nearest best;
    search(0, vertex, best);
    return best.vertex;
  }

 private:
  static constexpr std::size_t leaf_size = 16;
  static constexpr Index mixed = -1;

  struct Node {
    std::size_t begin, end;   // vertices order_[begin] .. order_[end - 1]
    std::size_t left, right;  // children; 0 for a leaf
    Index component;          // of all its vertices, or mixed
    Index first_vertex;       // the smallest index of a vertex
    std::array<double, 3> low, high;
  };
  struct Nearest {
    Index vertex = -1;
    double squared_distance = std::numeric_limits<double>::infinity();

    [[nodiscard]] bool loses_to(double other_distance, Index other) const {
      return other_distance < squared_distance ||
             (other_distance == squared_distance && (vertex < 0 || other < vertex));
    }
  };

  [[nodiscard]] std::array<double, 3> point(Index vertex) const {
    const auto& p = frame_[static_cast<std::size_t>(vertex)];
    return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
  }

  [[nodiscard]] Node enclose(std::size_t begin, std::size_t end) const {
    const Index first = order_[begin];
    Node node{begin, end,          0,           0, component_[static_cast<std::size_t>(first)],
              first, point(first), point(first)};
    for (std::size_t i = begin; i < end; ++i) {
      const auto p = point(order_[i]);
      for (std::size_t c = 0; c < 3; ++c) {
        node.low[c] = std::min(node.low[c], p[c]);
        node.high[c] = std::max(node.high[c], p[c]);
      }
      node.first_vertex = std::min(node.first_vertex, order_[i]);
      if (component_[static_cast<std::size_t>(order_[i])] != node.component) node.component = mixed;
    }
    return node;
  }

  std::size_t build(std::size_t begin, std::size_t end) {
    const std::size_t index = nodes_.size();
    nodes_.push_back(enclose(begin, end));
    if (end - begin <= leaf_size) return index;

    const auto& [low, high] = std::pair(nodes_[index].low, nodes_[index].high);
    std::size_t axis = 0;
    for (std::size_t c = 1; c < 3; ++c) {
      if (high[c] - low[c] > high[axis] - low[axis]) axis = c;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end),
                     [&](Index a, Index b) { return point(a)[axis] < point(b)[axis]; });
    const std::size_t left = build(begin, middle);
    const std::size_t right = build(middle, end);
    nodes_[index].left = left;
    nodes_[index].right = right;
    return index;
  }

  static double squared_distance_to_box(const std::array<double, 3>& p, const Node& node) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double outside = std::max({node.low[c] - p[c], p[c] - node.high[c], 0.0});
      sum += outside * outside;
    }
    return sum;
  }

  void search(std::size_t index, Index vertex, Nearest& best) const {
    const Node& node = nodes_[index];
    const auto p = point(vertex);
    const Index own = component_[static_cast<std::size_t>(vertex)];
    if (node.component == own ||
        !best.loses_to(squared_distance_to_box(p, node), node.first_vertex)) {
      return;
    }
    if (node.left == 0 && node.right == 0) {
      for (std::size_t i = node.begin; i < node.end; ++i) {
        const Index other = order_[i];
        if (component_[static_cast<std::size_t>(other)] == own) continue;
        const auto q = point(other);
        double distance = 0;
        for (std::size_t c = 0; c < 3; ++c) distance += (q[c] - p[c]) * (q[c] - p[c]);
        if (best.loses_to(distance, other)) best = {other, distance};
      }
      return;
    }
    const auto rank = [&](std::size_t child) {
      return std::pair(squared_distance_to_box(p, nodes_[child]), nodes_[child].first_vertex);
    };
    const bool left_first = rank(node.left) <= rank(node.right);
    search(left_first ? node.left : node.right, vertex, best);
    search(left_first ? node.right : node.left, vertex, best);
  }

  std::span<const Vector3<Real>> frame_;
  std::span<const Index> component_;
  std::vector<Index> order_;
  std::vector<Node> nodes_;
};

}  // namespace

template <class Real>
std::vector<Index> find_donors(std::span<const Vector3<Real>> frame,
                               std::span<const Index> component) {
  std::vector<Index> donors(frame.size(), -1);
  if (std::ranges::all_of(component, [](Index label) { return label == 0; })) return donors;
  const ComponentTree tree(frame, component);
  for (std::size_t v = 0; v < frame.size(); ++v) donors[v] = tree.nearest(static_cast<Index>(v));
  return donors;
}

template std::vector<Index> find_donors(std::span<const Vector3<float>>, std::span<const Index>);
template std::vector<Index> find_donors(std::span<const Vector3<double>>, std::span<const Index>);

}  // namespace dynmesh
