#include "c/status.hpp"

#include <array>
#include <cstring>

namespace dynmesh {
namespace {

using Message = std::array<char, 1024>;  // of fixed size, since reporting that memory is exhausted
                                         // must not allocate any

Message& last_message() noexcept {
  thread_local Message message{};
  return message;
}

}  // namespace

dynmesh_status fail(dynmesh_status status, const char* message) noexcept {
  Message& kept = last_message();
  std::size_t size = std::strlen(message);
  if (size >= kept.size()) {
    const auto is_inside_character = [&](std::size_t i) { return (message[i] & 0xC0) == 0x80; };
    size = kept.size() - 1;
    for (int back = 0; back < 3 && is_inside_character(size); ++back) --size;
  }
  std::memmove(kept.data(), message, size);
  kept[size] = '\0';
  return status;
}

}  // namespace dynmesh

const char* dynmesh_last_message() { return dynmesh::last_message().data(); }
