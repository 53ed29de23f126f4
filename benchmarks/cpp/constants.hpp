/// The constants of the library that `benchmarks/constants.py` changes, by name.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>
#include <variant>

#include "detail/constants.hpp"
#include "tracking/constants.hpp"

namespace dynmesh {

template <class Constants>
struct NamedConstant {
  std::string_view name;
  std::variant<int Constants::*, double Constants::*> member;
  double largest = std::numeric_limits<double>::infinity();

  [[nodiscard]] double value(const Constants& constants) const {
    return std::visit([&](auto m) { return static_cast<double>(constants.*m); }, member);
  }

  /// Multiplies it by `factor`: counts are rounded and at least 1, and of "1 - x" and "x - 1" it is
  /// this difference.
  void scale(Constants& constants, double factor) const {
    if (const auto* count = std::get_if<0>(&member)) {
      int& changed = constants.**count;
      changed = std::max(1, static_cast<int>(std::lround(changed * factor)));
      return;
    }
    double& changed = constants.*std::get<1>(member);
    const double origin = name.starts_with("1 - ") || name.ends_with(" - 1") ? 1 : 0;
    if (factor != 1) changed = std::min(largest, origin + factor * (changed - origin));
  }
};

inline constexpr NamedConstant<DetailConstants> detail_constants[] = {
    {"rounds", &DetailConstants::rounds},
    {"caution - 1", &DetailConstants::caution},
    {"caution_of_change - 1", &DetailConstants::caution_of_change},
    {"least_explained", &DetailConstants::least_explained},
    {"averagings", &DetailConstants::averagings},
    {"pull", &DetailConstants::pull},
    {"least_blend", &DetailConstants::least_blend},
    {"largest_blend", &DetailConstants::largest_blend},
    {"newest", &DetailConstants::newest},
    {"least_area", &DetailConstants::least_area},
};

inline constexpr NamedConstant<UncertaintyConstants> uncertainty_constants[] = {
    {"smoothings", &UncertaintyConstants::smoothings},
    {"shared_change", &UncertaintyConstants::shared_change},
    {"1 - kept", &UncertaintyConstants::kept},
    {"1 - kept_in_the_long_run", &UncertaintyConstants::kept_in_the_long_run},
    {"first_persistence", &UncertaintyConstants::first_persistence},
    {"1 - largest_persistence", &UncertaintyConstants::largest_persistence},
    {"averagings", &UncertaintyConstants::averagings},
    {"pull", &UncertaintyConstants::pull},
    {"least_size", &UncertaintyConstants::least_size},
    {"largest_size", &UncertaintyConstants::largest_size},
    {"variance_averagings", &UncertaintyConstants::variance_averagings},
};

inline constexpr double below_1 = 0.95;  // of shares and cosines

inline constexpr NamedConstant<TrackingConstants> tracking_constants[] = {
    {"prediction", &TrackingConstants::prediction, below_1},
    {"rigid_steps", &TrackingConstants::rigid_steps},
    {"rigid_scale", &TrackingConstants::rigid_scale},
    {"iterations_per_edge", &TrackingConstants::iterations_per_edge},
    {"steps", &TrackingConstants::steps},
    {"settled", &TrackingConstants::settled},
    {"preconditioned", &TrackingConstants::preconditioned},
    {"first_weight", &TrackingConstants::first_weight},
    {"last_weight", &TrackingConstants::last_weight},
    {"wide_radius", &TrackingConstants::wide_radius},
    {"narrow_radius", &TrackingConstants::narrow_radius},
    {"usual_distances", &TrackingConstants::usual_distances},
    {"least_scale", &TrackingConstants::least_scale},
    {"largest_scale", &TrackingConstants::largest_scale},
    {"agreement", &TrackingConstants::agreement, below_1},
    {"near", &TrackingConstants::near},
    {"pull", &TrackingConstants::pull, below_1},
    {"membrane", &TrackingConstants::membrane},
    {"tie_weight", &TrackingConstants::tie_weight},
};

/// Multiplies a constant by a factor. Returns whether there is one of that name.
template <class Constants>
bool scale(Constants& constants, std::span<const NamedConstant<Constants>> named,
           std::string_view name, double factor) {
  const auto found = std::ranges::find(named, name, &NamedConstant<Constants>::name);
  if (found != named.end()) found->scale(constants, factor);
  return found != named.end();
}

/// Returns the name of a constant by its number, and writes its value; null after the last one.
template <class Constants>
const char* nth(std::span<const NamedConstant<Constants>> named, std::size_t number,
                double& value) {
  if (number >= named.size()) return nullptr;
  value = named[number].value({});
  return named[number].name.data();
}

}  // namespace dynmesh
