/// What is printed as errors, for tests that expect nothing.
#pragma once

#include <iostream>
#include <sstream>
#include <string>

namespace dynmesh::testing {

/// While it lives, what goes to std::cerr, to which OpenMesh's own stream passes on what it gets.
class CapturedErrors {
 public:
  CapturedErrors() : usual_(std::cerr.rdbuf(text_.rdbuf())) {}
  ~CapturedErrors() { std::cerr.rdbuf(usual_); }
  CapturedErrors(const CapturedErrors&) = delete;
  CapturedErrors& operator=(const CapturedErrors&) = delete;
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::streambuf* usual_;
};

}  // namespace dynmesh::testing
