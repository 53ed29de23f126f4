#include "sweeps.hpp"

namespace dynmesh {

#define DYNMESH_DECLARE_SWEEPS(name)      \
  namespace name {                        \
  extern const Sweeps<float> of_floats;   \
  extern const Sweeps<double> of_doubles; \
  }
#ifdef DYNMESH_X86_64
DYNMESH_DECLARE_SWEEPS(x86_64_v2)
DYNMESH_DECLARE_SWEEPS(x86_64_v3)
#endif
DYNMESH_DECLARE_SWEEPS(portable)

namespace {

template <class Real>
const Sweeps<Real>* one_of(const Sweeps<float>& of_floats, const Sweeps<double>& of_doubles) {
  if constexpr (sizeof(Real) == sizeof(float)) {
    return &of_floats;
  } else {
    return &of_doubles;
  }
}

}  // namespace

template <class Real>
std::vector<const Sweeps<Real>*> runnable_sweeps() {
  std::vector<const Sweeps<Real>*> found;
#ifdef DYNMESH_X86_64
  // x86-64-v3 is these two, and what every processor has that has both.
  if (__builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0) {
    found.push_back(one_of<Real>(x86_64_v3::of_floats, x86_64_v3::of_doubles));
  }
  if (__builtin_cpu_supports("sse4.2") != 0) {
    found.push_back(one_of<Real>(x86_64_v2::of_floats, x86_64_v2::of_doubles));
  }
#endif
  found.push_back(one_of<Real>(portable::of_floats, portable::of_doubles));
  return found;
}

template std::vector<const Sweeps<float>*> runnable_sweeps();
template std::vector<const Sweeps<double>*> runnable_sweeps();

}  // namespace dynmesh
