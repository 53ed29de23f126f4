/// Arithmetic that does not depend on the program that calls the library.
#pragma once

#include <cfenv>

namespace dynmesh {

/// While it exists, the arithmetic of this thread, and of those that it starts, is the default one:
/// no signal is raised where a number is not finite, which the methods expect and check, rounding
/// is to the nearest number, and small numbers are not set to 0. Then what the caller has set
/// returns, with the flags that were raised before.
///
/// Every public function that computes begins with one.
class DefaultArithmetic {
 public:
  DefaultArithmetic() {
    std::fegetenv(&of_caller_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~DefaultArithmetic() { std::fesetenv(&of_caller_); }
  DefaultArithmetic(const DefaultArithmetic&) = delete;
  DefaultArithmetic& operator=(const DefaultArithmetic&) = delete;
  DefaultArithmetic(DefaultArithmetic&&) = delete;
  DefaultArithmetic& operator=(DefaultArithmetic&&) = delete;

 private:
  std::fenv_t of_caller_{};
};

}  // namespace dynmesh
