/// Captures what is printed as errors, for tests that expect no output.
#pragma once

#include <iostream>
#include <sstream>
#include <string>

namespace dynmesh::testing {

/// Captures the output to std::cerr, to which the stream of OpenMesh writes, during its lifetime.
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
