/// Arithmetic that does not depend on the program that calls the library.
#pragma once

#include <cfenv>

// fesetenv of mingw-w64 10 leaves the control register of SSE, or sets it to the default.
#if defined(__MINGW32__) && defined(__SSE__)
#include <xmmintrin.h>
#define DYNMESH_SSE_APART
#endif

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
#ifdef DYNMESH_SSE_APART
    constexpr unsigned usual = 0x1f80;  // nearest rounding, no signals, small numbers are kept
    _mm_setcsr(usual);
#endif
  }
  ~DefaultArithmetic() {
    std::fesetenv(&of_caller_);
#ifdef DYNMESH_SSE_APART
    _mm_setcsr(of_sse_);
#endif
  }
  DefaultArithmetic(const DefaultArithmetic&) = delete;
  DefaultArithmetic& operator=(const DefaultArithmetic&) = delete;
  DefaultArithmetic(DefaultArithmetic&&) = delete;
  DefaultArithmetic& operator=(DefaultArithmetic&&) = delete;

 private:
  std::fenv_t of_caller_{};
#ifdef DYNMESH_SSE_APART
  unsigned of_sse_ = _mm_getcsr();
#endif
};

}  // namespace dynmesh
