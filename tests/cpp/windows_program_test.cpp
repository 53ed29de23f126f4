/// dynmesh-complete on Windows: what differs from other systems. The rest is tested by
/// tests/python/test_program.py.
#define WIN32_LEAN_AND_MEAN
#define NOMINMAX
#include <doctest/doctest.h>
#include <windows.h>

#include <algorithm>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <dynmesh/template_mesh.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t n_frames = 3;

/// A folder whose name no code page of Windows can spell, with a template and partial frames.
class Job {
 public:
  Job() {
    std::wstring here(32768, L'\0');
    here.resize(GetModuleFileNameW(nullptr, here.data(), static_cast<DWORD>(here.size())));
    program = fs::path(here).parent_path() / DYNMESH_PROGRAM;
    folder = fs::path(here).parent_path() / L"\u7f51\u683c \u00e9\u0451";
    fs::remove_all(folder);
    fs::create_directories(folder);
    std::ofstream obj(folder / "body.obj");
    for (std::size_t v = 0; v < mesh.size(); ++v) {
      obj << "v " << mesh.vertices[3 * v] << ' ' << mesh.vertices[3 * v + 1] << ' '
          << mesh.vertices[3 * v + 2] << '\n';
    }
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      obj << "f " << mesh.indices[i] + 1 << ' ' << mesh.indices[i + 1] + 1 << ' '
          << mesh.indices[i + 2] + 1 << '\n';
    }
    obj.close();
    const TemplateMesh body = read_template(utf8(folder / "body.obj"));
    Completer<float> completer(body.triangles(), body.points());
    for (std::size_t n = 0; n < n_frames; ++n) {
      std::vector<float> frame = body.vertices;
      const auto known = random_mask(mesh.size(), 0.3, static_cast<unsigned>(n));
      for (std::size_t i = 0; i < frame.size(); ++i) {
        // Its bytes include those that text files would change on Windows: 0x0a, 0x0d and 0x1a.
        frame[i] += i % 2 == 0 ? 0x1.1a0d0ap-3F : 0.25F;
        if (known[i / 3] == 0) frame[i] = std::numeric_limits<float>::quiet_NaN();
      }
      append(partial, frame);
      completer.push({frame.data(), mesh.size()}, {frame.data(), mesh.size()});
      append(completed, frame);
    }
    write(folder / "partial.raw", partial);
  }
  ~Job() {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  static std::string utf8(const fs::path& path) {
    const std::u8string text = path.u8string();
    return {text.begin(), text.end()};
  }
  static void write(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }
  static std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  Mesh<float> mesh = sheet<float>(12);
  fs::path program, folder;
  std::string partial, completed;

 private:
  static void append(std::string& bytes, const std::vector<float>& frame) {
    bytes.append(reinterpret_cast<const char*>(frame.data()), sizeof(float) * frame.size());
  }
};

/// A pipe to or from the program.
struct Pipe {
  Pipe() {
    SECURITY_ATTRIBUTES inherited = {sizeof inherited, nullptr, TRUE};
    REQUIRE(CreatePipe(&from, &into, &inherited, 1 << 20) != 0);
  }
  ~Pipe() {
    close(from);
    close(into);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  static void close(HANDLE& handle) {
    if (handle != nullptr) CloseHandle(handle);
    handle = nullptr;
  }
  /// Returns what was written, until `lines` lines or the end.
  std::string read(std::ptrdiff_t lines) const {
    std::string text;
    char byte = 0;
    DWORD got = 0;
    while (std::ranges::count(text, '\n') < lines && ReadFile(from, &byte, 1, &got, nullptr) != 0 &&
           got == 1) {
      text += byte;
    }
    return text;
  }

  HANDLE from = nullptr;
  HANDLE into = nullptr;
};

constexpr std::ptrdiff_t all = std::numeric_limits<std::ptrdiff_t>::max();

/// The program while it runs.
class Running {
 public:
  Running(const Job& job, const std::wstring& options) {
    // A handle that the program inherits keeps the pipe open.
    SetHandleInformation(input.into, HANDLE_FLAG_INHERIT, 0);
    SetHandleInformation(output.from, HANDLE_FLAG_INHERIT, 0);
    SetHandleInformation(errors.from, HANDLE_FLAG_INHERIT, 0);
    std::wstring line = L"dynmesh-complete --template \"" + (job.folder / "body.obj").wstring() +
                        L"\" --report " + options;
    STARTUPINFOW start = {};
    start.cb = sizeof start;
    start.dwFlags = STARTF_USESTDHANDLES;
    start.hStdInput = input.from;
    start.hStdOutput = output.into;
    start.hStdError = errors.into;
    REQUIRE(CreateProcessW(job.program.c_str(), line.data(), nullptr, nullptr, TRUE,
                           CREATE_NO_WINDOW, nullptr, nullptr, &start, &process_) != 0);
    Pipe::close(input.from);
    Pipe::close(output.into);
    Pipe::close(errors.into);
  }
  ~Running() {
    CloseHandle(process_.hProcess);
    CloseHandle(process_.hThread);
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  void give(const std::string& bytes) const {
    DWORD written = 0;
    CHECK(WriteFile(input.into, bytes.data(), static_cast<DWORD>(bytes.size()), &written,
                    nullptr) != 0);
  }
  /// As Ctrl-C in the console of the program, which this process joins.
  void interrupt() const {
    FreeConsole();
    REQUIRE(AttachConsole(process_.dwProcessId) != 0);
    REQUIRE(SetConsoleCtrlHandler(nullptr, TRUE) != 0);  // this process receives it, too
    CHECK(GenerateConsoleCtrlEvent(CTRL_C_EVENT, 0) != 0);
  }
  DWORD wait() const {
    const bool ended = WaitForSingleObject(process_.hProcess, 30'000) == WAIT_OBJECT_0;
    CHECK(ended);
    if (!ended) TerminateProcess(process_.hProcess, 99);
    DWORD code = 0;
    GetExitCodeProcess(process_.hProcess, &code);
    return code;
  }

  Pipe input, output, errors;

 private:
  PROCESS_INFORMATION process_ = {};
};

std::wstring quoted(const fs::path& path) { return L"\"" + path.wstring() + L"\""; }

TEST_CASE("pipes pass all bytes unchanged") {
  const Job job;
  Running run(job, L"--input - --output -");
  run.give(job.partial);
  Pipe::close(run.input.into);
  CHECK(run.output.read(all) == job.completed);
  CHECK(run.wait() == 0);
}

TEST_CASE("the names of files are not restricted to a code page") {
  const Job job;
  const fs::path out = job.folder / L"\u0444.pc2";
  Running run(job, L"--input " + quoted(job.folder / "partial.raw") + L" --output " + quoted(out));
  CHECK(run.wait() == 0);
  CHECK(Job::read(out).substr(32) == job.completed);
  Running again(job, L"--input " + quoted(out) + L" --output " + quoted(out));
  CHECK(again.errors.read(all).find(Job::utf8(out)) != std::string::npos);
  CHECK(again.wait() == 2);
}

TEST_CASE("a file that another program has open is replaced, or the frames are kept beside it") {
  const Job job;
  const fs::path out = job.folder / "out.raw";
  Job::write(out, "precious");
  const std::wstring options =
      L"--overwrite --input " + quoted(job.folder / "partial.raw") + L" --output " + quoted(out);
  HANDLE open =
      CreateFileW(out.c_str(), GENERIC_READ, FILE_SHARE_READ, nullptr, OPEN_EXISTING, 0, nullptr);
  REQUIRE(open != INVALID_HANDLE_VALUE);
  const Running refused(job, options);
  const std::string error = refused.errors.read(all);
  CHECK(refused.wait() == 1);
  CHECK(error.find("out.raw: cannot be replaced: ") != std::string::npos);
  CloseHandle(open);
  CHECK(Job::read(out) == "precious");
  std::vector<fs::path> kept;
  for (const auto& entry : fs::directory_iterator(job.folder)) {
    if (entry.path().extension() == ".part") kept.push_back(entry.path());
  }
  REQUIRE(kept.size() == 1);
  CHECK(error.find("; all frames are in " + Job::utf8(kept[0])) != std::string::npos);
  CHECK(Job::read(kept[0]) == job.completed);

  const Running replaced(job, options);
  CHECK(replaced.wait() == 0);
  CHECK(Job::read(out) == job.completed);
}

TEST_CASE("an interrupt while the program waits for a frame keeps the frames so far") {
  const Job job;
  const fs::path out = job.folder / "out.raw";
  const Running run(job, L"--input - --output " + quoted(out));
  const std::size_t size = job.partial.size() / n_frames;
  run.give(job.partial.substr(0, 2 * size));
  std::string error = run.errors.read(2);  // both frames are completed
  run.interrupt();
  CHECK(run.wait() == 130);
  FreeConsole();  // which may keep the pipe open
  error += run.errors.read(3);
  CHECK(error.find("interrupted; all frames completed so far") != std::string::npos);
  CHECK(Job::read(out) == job.completed.substr(0, 2 * size));
}

}  // namespace
}  // namespace dynmesh::testing
