/// C does what C++ does, and what it has of its own: messages, null handles, templates. Completers
/// are compared by tests/fuzz/completer.cpp.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/template_mesh.hpp>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>
#include <tuple>

#include "c_completer.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "training_data.hpp"

// The layout that other languages declare.
static_assert(sizeof(dynmesh_points) == 40 && offsetof(dynmesh_points, type) == 32);
static_assert(sizeof(dynmesh_output) == 40 && offsetof(dynmesh_output, type) == 32);
static_assert(sizeof(dynmesh_mask) == 24);
static_assert(sizeof(dynmesh_settings) == 48 && offsetof(dynmesh_settings, noise) == 24);
static_assert(sizeof(dynmesh_frame_report) == 608 && offsetof(dynmesh_frame_report, reason) == 92);
static_assert(sizeof(dynmesh_template) == 32);
static_assert(sizeof(dynmesh_measure) == 680 && offsetof(dynmesh_measure, reason) == 164);
static_assert(sizeof(dynmesh_tracking_report) == 728);
static_assert(sizeof(dynmesh_agreement) == 32);
static_assert(sizeof(dynmesh_depth_image) == 248);

namespace dynmesh::testing {
namespace {

TEST_CASE("a null completer has nothing and is destroyed like any other") {
  CHECK(dynmesh_n_vertices(nullptr) == 0);
  CHECK(dynmesh_generation(nullptr) == nullptr);
  CHECK(dynmesh_age(nullptr) == nullptr);
  dynmesh_destroy(nullptr);
  dynmesh_training_destroy(nullptr);
  dynmesh_free_template(nullptr);
}

TEST_CASE("long messages are cut between two characters") {
  const dynmesh_template* mesh = nullptr;
  for (const std::string character : {"x", "\u00e9", "\u20ac", "\U0001f98c"}) {
    for (std::size_t shift = 0; shift < character.size(); ++shift) {
      std::string name(shift, 'x');
      while (name.size() < 1200) name += character;
      CHECK(dynmesh_read_template(name.c_str(), &mesh) == DYNMESH_UNREADABLE_FILE);
      const std::size_t whole = (1023 - shift) / character.size();
      CHECK(std::string(dynmesh_last_message()) ==
            name.substr(0, shift + whole * character.size()));
    }
  }
  // Bytes that are not UTF-8 are not searched for the beginning of a character.
  const std::string no_text(1200, '\x80');
  CHECK(dynmesh_read_template(no_text.c_str(), &mesh) == DYNMESH_UNREADABLE_FILE);
  CHECK(std::string(dynmesh_last_message()).size() == 1020);
}

TEST_CASE("each thread has its own last message, which successful calls keep") {
  CHECK(dynmesh_default_settings(nullptr, sizeof(dynmesh_settings)) == DYNMESH_INVALID_ARGUMENT);
  std::string elsewhere = "?";
  std::thread([&] { elsewhere = dynmesh_last_message(); }).join();
  CHECK(elsewhere.empty());
  const auto mesh = sheet<float>(3);
  const CCompleter<float> completer(mesh.faces(), mesh.points());
  CHECK(std::string(dynmesh_last_message()) == "settings: is a null pointer");
}

TEST_CASE("templates are read") {
  const auto folder = std::filesystem::temp_directory_path() / "dynmesh-c-interface-test";
  std::filesystem::create_directories(folder);
  const std::string path = (folder / "quad.obj").string();
  std::ofstream(path) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3 4\n";
  const dynmesh_template* mesh = nullptr;
  REQUIRE(dynmesh_read_template(path.c_str(), &mesh) == DYNMESH_OK);
  const TemplateMesh expected = read_template(path);
  REQUIRE(mesh->n_vertices == 4);
  REQUIRE(mesh->n_faces == 2);
  CHECK(std::equal(expected.vertices.begin(), expected.vertices.end(), mesh->vertices));
  CHECK(std::equal(expected.faces.begin(), expected.faces.end(), mesh->faces));
  dynmesh_free_template(mesh);
  std::filesystem::remove_all(folder);
}

TEST_CASE("the settings of C begin as those of C++") {
  dynmesh_settings settings{};
  REQUIRE(dynmesh_default_settings(&settings, sizeof settings) == DYNMESH_OK);
  const Settings theirs;
  CHECK(settings.method == DYNMESH_METHOD_DETAIL);
  CHECK(settings.disconnected == DYNMESH_DISCONNECTED_FOLLOW);
  CHECK(std::isnan(settings.noise));
  CHECK(std::tuple(settings.revisit, settings.extra_iterations, settings.reject_outliers,
                   settings.learn, settings.uncertainty, settings.threads) ==
        std::tuple(theirs.revisit, theirs.extra_iterations, theirs.reject_outliers, theirs.learn,
                   theirs.uncertainty, theirs.threads));
}

}  // namespace
}  // namespace dynmesh::testing
