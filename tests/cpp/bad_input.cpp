/// Passes bad input to the C++ and the C interface and prints one line for each case: interface,
/// call, what is wrong, and the message, separated by tabs. The exit code is 1 if bad input was
/// if something was accepted, was refused without naming what is wrong, or changed a completer or
/// its output. The page of bad input on the site is made of it.
#include "bad_input.hpp"

#include <cstdio>
#include <exception>

namespace dynmesh::testing {

int& faults() {
  static int count = 0;
  return count;
}

void fault(const char* call, const char* given, const std::string& what) {
  ++faults();
  std::fprintf(stderr, "%s, %s: %s\n", call, given, what.c_str());
}

void show(const char* interface, const char* call, const char* given, const std::string& answer,
          Names names) {
  std::printf("%s\t%s\t%s\t%s\n", interface, call, given, answer.c_str());
  if (answer.empty()) fault(call, given, "was accepted");
  for (const std::string_view name : names) {
    if (answer.find(name) == std::string::npos) {
      fault(call, given, "does not name '" + std::string(name) + "', but says: " + answer);
    }
  }
}

}  // namespace dynmesh::testing

int main() try {
  using namespace dynmesh::testing;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  World world;
  world.completer.push(world.points(), world.known(), world.out());
  try_cpp(world);
  try_c(world);
  try_c_tracker(world);
  return faults() == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
