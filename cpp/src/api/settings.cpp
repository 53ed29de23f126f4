#include <cmath>
#include <dynmesh/settings.hpp>

#include "api/settings_table.hpp"
#include "base/checks.hpp"
#include "base/default_arithmetic.hpp"

namespace dynmesh {
namespace {

template <class Value>
void check_value(const Setting& /*setting*/, const Value& /*value*/) {}

void check_value(const Setting& setting, const Index& value) {
  if (value >= setting.least && value <= setting.most) return;
  throw SettingError(setting.name,
                     joined("must be from ", setting.least, " to ", setting.most, ", not ", value));
}

void check_value(const Setting& setting, const std::optional<double>& value) {
  if (!value || (*value > 0 && std::isfinite(*value))) return;
  throw SettingError(setting.name, joined("must be positive and finite, not ", to_text(*value)));
}

}  // namespace

void check_settings(const Settings& settings) {
  const DefaultArithmetic arithmetic;
  const Settings defaults;
  for_each_setting([&](const Setting& setting, auto member, auto...) {
    const bool is_given = settings.*member != defaults.*member;
    if (is_given && setting.method && *setting.method != settings.method) {
      const auto method = names_of<Method>().at(static_cast<std::size_t>(*setting.method));
      throw SettingError(setting.name, joined("requires method ", method));
    }
    check_value(setting, settings.*member);
  });
}

void check_settings(const TrackerSettings& settings) {
  const DefaultArithmetic arithmetic;
  for_each_setting<TrackerSettings>([&](const Setting& setting, auto member, auto...) {
    check_value(setting, settings.*member);
  });
}

}  // namespace dynmesh
