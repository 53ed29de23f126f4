#include "c/conversions.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "api/settings_table.hpp"

namespace dynmesh {
namespace {

/// In C, an enumeration or a truth value is an int32, and NaN is none.
template <class Value, class Given>
Value setting_from_c(const char* name, Given given) {
  if constexpr (std::is_same_v<Value, std::optional<double>>) {
    return std::isnan(given) ? std::nullopt : Value(given);
  } else if constexpr (std::is_same_v<Value, bool>) {
    return given != 0;
  } else if constexpr (std::is_enum_v<Value>) {
    const auto names = names_of<Value>();
    if (given >= 0 && static_cast<std::size_t>(given) < names.size()) {
      return static_cast<Value>(given);
    }
    std::string listed;
    for (std::size_t i = 0; i < names.size(); ++i) {
      listed += joined(i == 0 ? "" : " or ", i, " (", names[i], ")");
    }
    refuse(name, "must be ", listed, ", not ", given);
  } else {
    return given;
  }
}

}  // namespace

std::size_t count_of(const char* argument, std::int64_t count) {
  if (count < 0 || count > std::numeric_limits<Index>::max()) {
    refuse(argument, "must have 0 to 2147483647 rows, not ", count);
  }
  return static_cast<std::size_t>(count);
}

Faces faces_of(const std::int32_t* faces, std::int64_t n_faces) {
  return {faces, count_of("faces", n_faces)};
}

KnownMask mask_of(const dynmesh_mask& mask) {
  const std::int64_t stride = mask.stride == 0 ? 1 : mask.stride;
  return {mask.data, count_of("known", mask.count), static_cast<std::ptrdiff_t>(stride)};
}

std::vector<DepthImage> images_of(const dynmesh_depth_image* images, std::int64_t n_images) {
  const std::size_t count = count_of("images", n_images);
  check_pointer("images", images, count);
  std::vector<DepthImage> converted;
  for (const dynmesh_depth_image& given : std::span(images, count)) {
    const auto side = [&](const char* name, std::int64_t value) {
      if (value >= 0) return static_cast<std::size_t>(value);
      refuse("images", "image ", converted.size(), " cannot have a ", name, " of ", value);
    };
    const bool is_packed = given.row_stride == 0;
    const bool is_dense = is_packed || given.column_stride == 0;
    DepthImage image;
    image.data = given.data;
    image.height = side("height", given.height);
    image.width = side("width", given.width);
    image.row_stride = static_cast<std::ptrdiff_t>(is_packed ? given.width : given.row_stride);
    image.column_stride = static_cast<std::ptrdiff_t>(is_dense ? 1 : given.column_stride);
    std::ranges::copy(given.intrinsics, image.intrinsics.begin());
    std::ranges::copy(given.pose, image.pose.begin());
    image.colours = given.colours;
    converted.push_back(image);
  }
  return converted;
}

void check_settings_size(const char* argument, std::int64_t size) {
  constexpr auto known = static_cast<std::int64_t>(sizeof(dynmesh_settings));
  if (size == known) return;
  refuse(argument, "is ", size, ", but this version of dynmesh expects settings of ", known,
         " bytes; call dynmesh_default_settings first");
}

Settings settings_of(const dynmesh_settings* chosen) {
  Settings settings;
  if (chosen == nullptr) return settings;
  const dynmesh_settings& given = *chosen;
  check_settings_size("settings.size", given.size);
  for_each_setting<Settings, dynmesh_settings>(
      [&]<class Value>(const Setting& setting, Value Settings::*member, auto member_in_c) {
        settings.*member = setting_from_c<Value>(setting.name, given.*member_in_c);
      });
  return settings;
}

dynmesh_measure measure_of(const Measure& measure) {
  auto converted = to_c<dynmesh_measure>(measure);
  converted.agreement = to_c<dynmesh_agreement>(measure.agreement);
  converted.quality = static_cast<std::int32_t>(measure.quality);
  const std::string reason = measure.reason();
  reason.copy(converted.reason, sizeof converted.reason - 1);
  return converted;
}

}  // namespace dynmesh
