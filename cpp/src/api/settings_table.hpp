/// Every setting of a completer and of a tracker, once: the checks, the stored states, the C
/// interface, the options of the program and the Python binding all go through this table.
/// docs/architecture.md tells what else a new setting needs.
#pragma once

#include <algorithm>
#include <array>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "base/checks.hpp"

namespace dynmesh {

/// What there is to know about a setting beside its value.
struct Setting {
  const char* name;  ///< in C++, C and Python; command lines have hyphens in it
  std::optional<Method> method = std::nullopt;  ///< the one method that takes it; none: all do
  bool is_stored = true;  ///< whether a state fits only completers with the same value
  Index least = 0;        ///< of whole numbers
  Index most = std::numeric_limits<Index>::max();
};

inline constexpr Setting threads_setting = {
    .name = "threads", .is_stored = false, .least = 1, .most = 256};

/// Calls `visit(setting, member, member_of_twin)` for each of them, with pointers to the members of
/// that name of Settings and `Twin`, such as the structure of the C interface; for TrackerSettings,
/// which C passes one by one, without the last.
template <class Owner = Settings, class Twin = Owner, class Visit>
void for_each_setting(const Visit& visit) {
  if constexpr (std::is_same_v<Owner, TrackerSettings>) {
    visit(Setting{"uncertainty"}, &TrackerSettings::uncertainty);
    visit(Setting{"recover"}, &TrackerSettings::recover);
    visit(Setting{"resolution"}, &TrackerSettings::resolution);
    visit(threads_setting, &TrackerSettings::threads);
  } else {
    visit(Setting{"method"}, &Settings::method, &Twin::method);
    visit(Setting{"revisit", Method::motion}, &Settings::revisit, &Twin::revisit);
    visit(Setting{.name = "extra_iterations", .method = Method::motion, .most = 1'000'000},
          &Settings::extra_iterations, &Twin::extra_iterations);
    visit(Setting{"disconnected"}, &Settings::disconnected, &Twin::disconnected);
    visit(Setting{"noise", Method::detail}, &Settings::noise, &Twin::noise);
    visit(Setting{"reject_outliers", Method::detail}, &Settings::reject_outliers,
          &Twin::reject_outliers);
    visit(Setting{"learn", Method::detail}, &Settings::learn, &Twin::learn);
    visit(Setting{"uncertainty", Method::detail}, &Settings::uncertainty, &Twin::uncertainty);
    visit(threads_setting, &Settings::threads, &Twin::threads);
  }
}

/// The names of the values of an enumeration, in their order.
template <class Enumeration>
constexpr std::array<std::string_view, 2> names_of() {
  if constexpr (std::is_same_v<Enumeration, Method>) return {"motion", "detail"};
  if constexpr (std::is_same_v<Enumeration, DisconnectedRule>) return {"hold", "follow"};
}

/// The value of that name. Throws SettingError.
template <class Enumeration>
Enumeration from_name(const char* setting, std::string_view name) {
  const auto names = names_of<Enumeration>();
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<Enumeration>(found - names.begin());
  std::string listed;
  for (const std::string_view known : names) {
    listed += joined(listed.empty() ? "'" : " or '", known, "'");
  }
  throw SettingError(setting, joined("must be ", listed, ", not '", name, "'"));
}

}  // namespace dynmesh
