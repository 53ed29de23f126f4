/// The names of files, which are UTF-8 on every system.
#pragma once

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>

namespace dynmesh {

/// Returns the path of the file that is called `name`. Windows would otherwise read the name in the
/// code page of the machine. Other systems use the bytes as they are. Throws
/// std::filesystem::filesystem_error on Windows if `name` is not UTF-8.
inline std::filesystem::path path_of(const std::string& name) {
  return {std::u8string(name.begin(), name.end())};
}

/// Returns ".obj" for "Body.OBJ". Throws like path_of.
inline std::string lowercase_suffix(const std::string& name) {
  const std::u8string found = path_of(name).extension().u8string();
  std::string suffix(found.begin(), found.end());
  std::ranges::transform(suffix, suffix.begin(), [](unsigned char c) { return std::tolower(c); });
  return suffix;
}

}  // namespace dynmesh
