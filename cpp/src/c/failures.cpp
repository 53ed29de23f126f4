#include "c/failures.hpp"

#include <array>
#include <cstring>

namespace dynmesh {
namespace {

/// It is of fixed size, since reporting that memory is exhausted must not allocate any.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
thread_local std::array<char, 1024> last_message{};

}  // namespace

dynmesh_status fail(dynmesh_status status, const char* message) noexcept {
  std::size_t size = std::strlen(message);
  if (size >= last_message.size()) {
    size = last_message.size() - 1;
    for (int back = 0; back < 3 && (message[size] & 0xC0) == 0x80; ++back) --size;
  }
  std::memmove(last_message.data(), message, size);
  last_message[size] = '\0';
  return status;
}

}  // namespace dynmesh

const char* dynmesh_last_message() { return dynmesh::last_message.data(); }
