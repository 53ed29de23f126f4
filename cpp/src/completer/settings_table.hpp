/// Every setting of a completer, once: the checks, the stored states, the command line of
/// dynmesh-complete and the Python binding all go through this table.
///
/// A new setting is a member of Settings, a row here, and a field of dynmesh_settings in C.
#pragma once

#include <algorithm>
#include <array>
#include <dynmesh/settings.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace dynmesh {

/// What there is to know about a setting beside its value.
struct Setting {
  const char* name;              ///< in C++ and Python; command lines have hyphens in it
  std::optional<Method> method;  ///< the one method that takes it; none: all of them do
  bool is_stored = true;         ///< whether a state fits only completers with the same value
  Index least = 0;               ///< of whole numbers
  Index most = std::numeric_limits<Index>::max();
  const char* value = "";  ///< what stands for the value in help texts
  const char* help;
};

/// Calls `visit(setting, member)` for each of them, with `member` a pointer to a member of
/// Settings.
template <class Visit>
void for_each_setting(const Visit& visit) {
  visit(Setting{.name = "method",
                .method = std::nullopt,
                .value = "METHOD",
                .help = "'detail' (default) keeps the shape of the mesh, rotated with the motion. "
                        "'motion', the paper's method, is less accurate, but fast."},
        &Settings::method);
  visit(Setting{.name = "revisit",
                .method = Method::motion,
                .help = "Estimate every satellite only once, when it is reached, and not again in "
                        "each iteration: another reading of the paper."},
        &Settings::revisit);
  visit(Setting{.name = "extra_iterations",
                .method = Method::motion,
                .most = 1'000'000,
                .value = "N",
                .help = "Iterations after the one that reaches the last satellite (default 0). Ten "
                        "reduce the error by a third on many sequences."},
        &Settings::extra_iterations);
  visit(Setting{.name = "disconnected",
                .method = std::nullopt,
                .value = "RULE",
                .help = "Parts of the mesh without any known vertex 'follow' the nearest surface "
                        "(default) or 'hold' their position."},
        &Settings::disconnected);
  visit(Setting{.name = "noise",
                .method = Method::detail,
                .value = "SIGMA",
                .help = "The standard deviation of the known positions, in their unit; they are "
                        "smoothed. By default they are exact."},
        &Settings::noise);
  visit(Setting{.name = "reject_outliers",
                .method = Method::detail,
                .help = "Treat known vertices that move unlike those around them as missing."},
        &Settings::reject_outliers);
  visit(Setting{.name = "learn",
                .method = Method::detail,
                .help = "Learn from the completed frames how the shape of the subject varies: more "
                        "accurate if motions recur, and about twice as slow."},
        &Settings::learn);
  visit(Setting{.name = "uncertainty",
                .method = Method::detail,
                .help = "Estimate how far each completed vertex may be off, in the unit of the "
                        "positions."},
        &Settings::uncertainty);
  visit(Setting{.name = "threads",
                .method = std::nullopt,
                .is_stored = false,
                .least = 1,
                .most = 256,
                .value = "N",
                .help = "The number of threads that a frame may use (default 1)."},
        &Settings::threads);
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
