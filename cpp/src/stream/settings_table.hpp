/// Every setting of a completer and of a tracker, once: the checks, the stored states, the C
/// interface, the command lines, the Python binding and its documentation all go through this
/// table.
///
/// A new setting is a member of Settings, a row here, a field of dynmesh_settings in C, and a key
/// of the type Settings in python/dynmesh/settings.py.
#pragma once

#include <dynmesh/dynmesh.h>

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

namespace dynmesh {

/// What there is to know about a setting beside its value.
struct Setting {
  const char* name;  ///< in C++, C and Python; command lines have hyphens in it
  std::optional<Method> method = std::nullopt;  ///< the one method that takes it; none: all do
  bool is_stored = true;  ///< whether a state fits only completers with the same value
  Index least = 0;        ///< of whole numbers
  Index most = std::numeric_limits<Index>::max();
  const char* value = "";    ///< what stands for the value in help texts
  const char* help = "";     ///< one sentence or two, for the program
  const char* without = "";  ///< of one that is on by default: what happens without it
};

inline constexpr Setting uncertainty_setting = {
    .name = "uncertainty",
    .help = "Compute the standard error of each vertex, in the unit of the positions."};
inline constexpr Setting threads_setting = {
    .name = "threads",
    .is_stored = false,
    .least = 1,
    .most = 256,
    .value = "N",
    .help = "The number of threads that may work on a frame of a large mesh."};

/// Calls `visit(setting, member, member_in_c)` for each of them, with pointers to members of
/// Settings and dynmesh_settings; for TrackerSettings, which C passes one by one, without the last.
template <class Owner = Settings, class Visit>
void for_each_setting(const Visit& visit) {
  if constexpr (std::is_same_v<Owner, TrackerSettings>) {
    visit(uncertainty_setting, &TrackerSettings::uncertainty);
    visit(Setting{.name = "recover"}, &TrackerSettings::recover);
    visit(threads_setting, &TrackerSettings::threads);
  } else {
    visit(Setting{.name = "method",
                  .value = "METHOD",
                  .help = "'detail' preserves the shape of frame 0 and of the last frame, rotated "
                          "with the motion. 'motion' averages motion vectors as in the paper, and "
                          "is fast."},
          &Settings::method, &dynmesh_settings::method);
    visit(
        Setting{.name = "revisit",
                .method = Method::motion,
                .help = "Estimate each unknown vertex again in every iteration.",
                .without = "Estimate each vertex only once, when it is reached: another reading of "
                           "the paper, in which errors accumulate from frame to frame."},
        &Settings::revisit, &dynmesh_settings::revisit);
    visit(Setting{.name = "extra_iterations",
                  .method = Method::motion,
                  .most = 1'000'000,
                  .value = "N",
                  .help = "Iterations after the one that reaches the last unknown vertex."},
          &Settings::extra_iterations, &dynmesh_settings::extra_iterations);
    visit(Setting{.name = "disconnected",
                  .value = "RULE",
                  .help = "Parts that no chain of edges connects to a known vertex 'follow' the "
                          "nearest surface, or 'hold' their position."},
          &Settings::disconnected, &dynmesh_settings::disconnected);
    visit(Setting{.name = "noise",
                  .method = Method::detail,
                  .value = "SIGMA",
                  .help = "The standard deviation of the noise of the known positions, in the unit "
                          "of the positions; they are smoothed. Without it, they are exact."},
          &Settings::noise, &dynmesh_settings::noise);
    visit(Setting{.name = "reject_outliers",
                  .method = Method::detail,
                  .help = "Treat known vertices as unknown if they do not move like those around "
                          "them."},
          &Settings::reject_outliers, &dynmesh_settings::reject_outliers);
    visit(Setting{.name = "learn",
                  .method = Method::detail,
                  .help = "Learn from the completed frames how the shape of the subject varies: "
                          "more accurate if motions recur, and about twice as slow."},
          &Settings::learn, &dynmesh_settings::learn);
    Setting uncertainty = uncertainty_setting;
    uncertainty.method = Method::detail;
    visit(uncertainty, &Settings::uncertainty, &dynmesh_settings::uncertainty);
    visit(threads_setting, &Settings::threads, &dynmesh_settings::threads);
  }
}

/// The names of the values of an enumeration, in their order.
template <class Enumeration>
inline constexpr std::array<std::string_view, 0> names_of{};
template <>
inline constexpr std::array<std::string_view, 2> names_of<Method> = {"motion", "detail"};
template <>
inline constexpr std::array<std::string_view, 2> names_of<DisconnectedRule> = {"hold", "follow"};

/// The value of that name. Throws SettingError.
template <class Enumeration>
Enumeration from_name(const char* setting, std::string_view name) {
  const auto& names = names_of<Enumeration>;
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<Enumeration>(found - names.begin());
  std::string listed;
  for (const std::string_view known : names) {
    listed += (listed.empty() ? "'" : " or '") + std::string(known) + "'";
  }
  throw SettingError(setting, "must be " + listed + ", not '" + std::string(name) + "'");
}

}  // namespace dynmesh
