/// What OpenMesh prints, for tests that expect nothing.
#pragma once

#include <OpenMesh/Core/System/omstream.hh>
#include <iostream>
#include <sstream>
#include <string>

namespace dynmesh::testing {

/// What is written to OpenMesh's stream for errors, which is otherwise connected to std::cerr.
class CapturedOpenMesh {
 public:
  CapturedOpenMesh() {
    omerr().disconnect(std::cerr);
    omerr().connect(text_);
  }
  ~CapturedOpenMesh() {
    omerr().disconnect(text_);
    omerr().connect(std::cerr);
  }
  CapturedOpenMesh(const CapturedOpenMesh&) = delete;
  CapturedOpenMesh& operator=(const CapturedOpenMesh&) = delete;
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
};

}  // namespace dynmesh::testing
