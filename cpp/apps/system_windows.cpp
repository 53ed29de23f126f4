#define WIN32_LEAN_AND_MEAN
#define NOMINMAX
#include <windows.h>
// After windows.h, which declares what it needs.
#include <fcntl.h>
#include <io.h>
#include <shellapi.h>

#include <atomic>
#include <csignal>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "support/paths.hpp"
#include "system.hpp"

namespace dynmesh::app {
namespace {

/// What the thread that reads shares with the thread in which Windows calls the handler.
struct Stop {
  std::atomic<int> caught = 0;
  std::mutex mutex;
  HANDLE reader = nullptr;  ///< the thread that waits for input, if one does
};

Stop& stop() {
  static Stop shared;
  return shared;
}

/// Keeps running until the process ends. Windows would otherwise end it when the handler of a
/// closed console returns.
BOOL WINAPI handle(DWORD event) {
  stop().caught = event == CTRL_C_EVENT || event == CTRL_BREAK_EVENT ? SIGINT : SIGTERM;
  while (true) {
    {
      // Nothing but the reading may be cancelled, since frames would be lost.
      const std::lock_guard lock(stop().mutex);
      if (stop().reader != nullptr) CancelSynchronousIo(stop().reader);
    }
    Sleep(10);  // the reading may not have begun to wait yet
  }
}

std::string utf8(std::wstring_view text) {
  const int size = static_cast<int>(text.size());
  std::string converted(3 * text.size(), '\0');
  const int written = WideCharToMultiByte(CP_UTF8, 0, text.data(), size, converted.data(),
                                          static_cast<int>(converted.size()), nullptr, nullptr);
  converted.resize(static_cast<std::size_t>(written));
  return converted;
}

}  // namespace

Arguments::Arguments(int, char**) {
  int count = 0;
  const std::unique_ptr<LPWSTR, decltype(&LocalFree)> wide(
      CommandLineToArgvW(GetCommandLineW(), &count), LocalFree);
  if (!wide) throw std::runtime_error("the command line cannot be read");
  for (int i = 0; i < count; ++i) texts_.push_back(utf8(wide.get()[i]));
  for (std::string& text : texts_) pointers_.push_back(text.data());
  pointers_.push_back(nullptr);
}

void stop_on_signals() { SetConsoleCtrlHandler(handle, TRUE); }

int caught_signal() { return stop().caught; }

std::FILE* open_binary(const std::string& path, const char* mode) {
  return _wfopen(path_of(path).c_str(), path_of(mode).c_str());
}

void make_binary(std::FILE* stream) { _setmode(_fileno(stream), _O_BINARY); }

std::size_t read_bytes(std::FILE* file, void* data, std::size_t size, bool& interrupted) {
  const auto set_reader = [](HANDLE thread) {
    const std::lock_guard lock(stop().mutex);
    return std::exchange(stop().reader, thread);
  };
  HANDLE thread = nullptr;
  DuplicateHandle(GetCurrentProcess(), GetCurrentThread(), GetCurrentProcess(), &thread, 0, FALSE,
                  DUPLICATE_SAME_ACCESS);
  set_reader(thread);
  const std::size_t got = std::fread(data, 1, size, file);
  set_reader(nullptr);
  CloseHandle(thread);
  interrupted = std::ferror(file) != 0 && caught_signal() != 0;
  return got;
}

unsigned long process_number() { return GetCurrentProcessId(); }

}  // namespace dynmesh::app
