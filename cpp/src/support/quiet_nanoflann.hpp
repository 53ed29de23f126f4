/// nanoflann, which prints to stderr before it throws std::bad_alloc. A library must not print, and
/// nanoflann has no setting for this, so its only call of fprintf is taken out.
#pragma once

// What nanoflann includes comes first, so that the macro changes nothing else.
#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <future>
#include <istream>
#include <limits>
#include <ostream>
#include <stdexcept>
#include <unordered_set>
#include <vector>

#pragma push_macro("fprintf")
#undef fprintf
#define fprintf(...) static_cast<void>(0)
#include <nanoflann.hpp>
#pragma pop_macro("fprintf")
