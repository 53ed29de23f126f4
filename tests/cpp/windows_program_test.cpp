/// dynmesh-complete on Windows: what differs from other systems. Its pipes are used by
/// script/try-platforms; the rest is tested by tests/python/test_program.py.
#include <doctest/doctest.h>
#include <share.h>

#include <cstdio>
#include <cstdlib>
#include <dynmesh/completer.hpp>
#include <dynmesh/template_mesh.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "meshes.hpp"
#include "support/paths.hpp"

namespace dynmesh::testing {
namespace {

namespace fs = std::filesystem;

std::string utf8(const fs::path& path) {
  const std::u8string text = path.u8string();
  return {text.begin(), text.end()};
}

void write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A folder whose name no code page of Windows can spell, with a template and partial frames.
struct Job {
  Job() {
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
    for (unsigned n = 0; n < 3; ++n) {
      std::vector<float> frame = body.vertices;
      const auto known = random_mask(mesh.size(), 0.3, n);
      for (std::size_t i = 0; i < frame.size(); ++i) {
        // Its bytes include those that text files would change on Windows: 0x0a, 0x0d and 0x1a.
        frame[i] += i % 2 == 0 ? 0x1.1a0d0ap-3F : 0.25F;
        if (known[i / 3] == 0) frame[i] = std::numeric_limits<float>::quiet_NaN();
      }
      const auto bytes = [&] {
        return std::string(reinterpret_cast<const char*>(frame.data()),
                           sizeof(float) * frame.size());
      };
      partial += bytes();
      completer.push({frame.data(), mesh.size()}, {frame.data(), mesh.size()});
      completed += bytes();
    }
    write(input, partial);
  }

  /// Runs the program, with what it prints in the file `errors`. Returns its exit code.
  int run(const std::wstring& options) const {
    const fs::path program(DYNMESH_PROGRAM);
    // The outer quotes are those that the shell takes away.
    const std::wstring line = L"\"" + quoted(program) + L" --template " +
                              quoted(folder / "body.obj") + L" " + options + L" 2>" +
                              quoted(errors) + L"\"";
    return _wsystem(line.c_str());
  }
  static std::wstring quoted(const fs::path& path) { return L"\"" + path.wstring() + L"\""; }

  Mesh<float> mesh = sheet<float>(12);
  fs::path folder = fs::temp_directory_path() / L"dynmesh \u7f51\u683c \u00e9\u0451";
  fs::path input = folder / "partial.raw", output = folder / L"\u0444.raw";
  fs::path errors = folder / "errors";
  std::string partial, completed;
};

TEST_CASE("the names of files are not restricted to a code page") {
  const Job job;
  const std::wstring options =
      L"--input " + Job::quoted(job.input) + L" --output " + Job::quoted(job.output);
  CHECK(job.run(options) == 0);
  CHECK(read(job.output) == job.completed);
  CHECK(job.run(options) == 1);
  CHECK(read(job.errors).find(utf8(job.output) + ": exists already") != std::string::npos);
}

TEST_CASE("a file that another program has open is replaced, or the frames are kept beside it") {
  const Job job;
  write(job.output, "precious");
  const std::wstring options =
      L"--overwrite --input " + Job::quoted(job.input) + L" --output " + Job::quoted(job.output);
  std::FILE* open = _wfsopen(job.output.c_str(), L"rb", _SH_DENYWR);
  REQUIRE(open != nullptr);
  CHECK(job.run(options) == 1);
  std::fclose(open);
  const std::string kept = utf8(job.output) + ".part";
  CHECK(read(job.errors).find("cannot be replaced: ") != std::string::npos);
  CHECK(read(job.errors).find("; it is in " + kept) != std::string::npos);
  CHECK(read(job.output) == "precious");
  CHECK(read(path_of(kept)) == job.completed);
  fs::remove(path_of(kept));
  CHECK(job.run(options) == 0);
  CHECK(read(job.output) == job.completed);
}

}  // namespace
}  // namespace dynmesh::testing
