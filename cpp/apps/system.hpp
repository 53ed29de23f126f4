/// What dynmesh-complete needs from the operating system: system_posix.cpp or system_windows.cpp.
/// The names of files are UTF-8.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

namespace dynmesh::app {

/// The arguments of main, in UTF-8. Windows passes them to main in the code page of the machine.
class Arguments {
 public:
  Arguments(int argc, char** argv);

  [[nodiscard]] int count() const { return static_cast<int>(pointers_.size()) - 1; }
  /// A null pointer follows the last one, as in argv.
  [[nodiscard]] char** values() { return pointers_.data(); }

 private:
  std::vector<std::string> texts_;
  std::vector<char*> pointers_;
};

/// Makes Ctrl-C and a request to end the process stop the program after the current frame, so that
/// the completed frames are not lost. If the reader of a pipe exits, writing then fails, which is
/// reported.
void stop_on_signals();

/// SIGINT, SIGTERM, or 0 if the program was not asked to stop.
int caught_signal();

/// Like std::fopen for a binary file. `mode` is "rb" or "wb".
std::FILE* open_binary(const std::string& path, const char* mode);

/// Lets standard input or output pass all bytes unchanged.
void make_binary(std::FILE* stream);

/// Like std::fread of bytes. A signal that stops the program interrupts it; `interrupted` then
/// becomes true.
std::size_t read_bytes(std::FILE* file, void* data, std::size_t size, bool& interrupted);

/// The number of this process, which no other running process has.
unsigned long process_number();

}  // namespace dynmesh::app
