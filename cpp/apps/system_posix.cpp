#include <unistd.h>

#include <cerrno>
#include <csignal>

#include "system.hpp"

namespace dynmesh::app {
namespace {

// A signal handler can access nothing else.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
volatile std::sig_atomic_t caught = 0;

/// A signal that was ignored when the program was started stays ignored, as background jobs of a
/// shell script expect.
void stop_on(int signal) {
  struct sigaction action {};
  sigaction(signal, nullptr, &action);
  if (action.sa_handler == SIG_IGN) return;
  action = {};
  action.sa_handler = [](int number) { caught = number; };
  sigaction(signal, &action, nullptr);  // without SA_RESTART, a blocking read returns
}

}  // namespace

Arguments::Arguments(int argc, char** argv) : pointers_(argv, argv + argc + 1) {}

void stop_on_signals() {
  std::signal(SIGPIPE, SIG_IGN);
  stop_on(SIGINT);
  stop_on(SIGTERM);
}

int caught_signal() { return caught; }

std::FILE* open_binary(const std::string& path, const char* mode) {
  return std::fopen(path.c_str(), mode);
}

void make_binary(std::FILE*) {}

std::size_t read_bytes(std::FILE* file, void* data, std::size_t size, bool& interrupted) {
  const std::size_t got = std::fread(data, 1, size, file);
  interrupted = std::ferror(file) != 0 && errno == EINTR;
  return got;
}

unsigned long process_number() { return static_cast<unsigned long>(getpid()); }

}  // namespace dynmesh::app
