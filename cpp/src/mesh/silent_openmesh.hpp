#pragma once

#include <OpenMesh/Core/System/omstream.hh>
#include <mutex>

namespace dynmesh {

/// While it lives, OpenMesh prints nothing. Its error stream is one global that threads cannot
/// share, so these objects wait for one another.
class SilentOpenMesh {
 public:
  SilentOpenMesh() : lock_(mutex()), was_enabled_(omerr().is_enabled()) { omerr().disable(); }
  ~SilentOpenMesh() {
    if (was_enabled_) omerr().enable();
  }
  SilentOpenMesh(const SilentOpenMesh&) = delete;
  SilentOpenMesh& operator=(const SilentOpenMesh&) = delete;
  SilentOpenMesh(SilentOpenMesh&&) = delete;
  SilentOpenMesh& operator=(SilentOpenMesh&&) = delete;

 private:
  static std::mutex& mutex() {
    static std::mutex instance;
    return instance;
  }
  std::lock_guard<std::mutex> lock_;
  bool was_enabled_;
};

}  // namespace dynmesh
