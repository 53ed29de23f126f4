#include <array>
#include <cmath>
#include <cstdio>
#include <dynmesh/settings.hpp>
#include <string>

namespace dynmesh {

void check_settings(const Settings& settings) {
  constexpr Index most_extra_iterations = 1'000'000;
  if (settings.extra_iterations < 0 || settings.extra_iterations > most_extra_iterations) {
    throw SettingError("extra_iterations", "must be from 0 to " +
                                               std::to_string(most_extra_iterations) + ", not " +
                                               std::to_string(settings.extra_iterations));
  }
  constexpr Index most_threads = 256;
  if (settings.threads < 1 || settings.threads > most_threads) {
    throw SettingError("threads", "must be from 1 to " + std::to_string(most_threads) + ", not " +
                                      std::to_string(settings.threads));
  }
  if (settings.method == Method::detail) {
    if (!settings.revisit) {
      throw SettingError("revisit", "is a setting of method motion, not of detail");
    }
    if (settings.extra_iterations != 0) {
      throw SettingError("extra_iterations", "is a setting of method motion, not of detail");
    }
  }
  if (settings.method == Method::motion) {
    const std::string exactly =
        "is no setting of method motion, which takes anchors exactly as they are";
    if (settings.noise) throw SettingError("noise", exactly);
    if (settings.reject_outliers) throw SettingError("reject_outliers", exactly);
  }
  if (settings.noise && !(*settings.noise > 0 && std::isfinite(*settings.noise))) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.9g", *settings.noise);
    throw SettingError("noise", std::string("must be positive and finite, not ") + text.data());
  }
}

Method method_from_name(std::string_view name) {
  if (name == "motion") return Method::motion;
  if (name == "detail") return Method::detail;
  throw SettingError("method", "must be 'motion' or 'detail', not '" + std::string(name) + "'");
}

UnseenRule unseen_rule_from_name(std::string_view name) {
  if (name == "hold") return UnseenRule::hold;
  if (name == "follow") return UnseenRule::follow;
  throw SettingError("unseen", "must be 'hold' or 'follow', not '" + std::string(name) + "'");
}

}  // namespace dynmesh
