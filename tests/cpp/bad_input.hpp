/// What the cases of bad input share: what they are tried on, and how an answer is judged and
/// shown.
#pragma once

#include <dynmesh/dynmesh.h>

#include <array>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <initializer_list>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "meshes.hpp"

namespace dynmesh::testing {

/// A completer after its first frame, and good arguments for its calls.
struct World {
  Mesh<double> mesh = sheet<double>(7);
  std::size_t k = mesh.size();
  std::vector<double> given = turned(mesh.vertices, 0.2);
  std::vector<double> written = std::vector<double>(3 * k);
  std::vector<std::uint8_t> seen = random_mask(k, 0.5, 1);
  Completer<double> completer{mesh.faces(), mesh.points()};

  Points<const double> points() { return {given.data(), k}; }
  KnownMask known() { return {seen.data(), k}; }
  Points<double> out() { return {written.data(), k}; }
};

/// What a message must contain: the argument, the place, the value.
using Names = std::initializer_list<std::string_view>;

/// The number of cases that failed.
int& faults();

/// Counts a fault and reports it on stderr.
void fault(const char* call, const char* given, const std::string& what);

/// Prints a case as a line of the table. It is a fault if the answer is empty or lacks a name.
void show(const char* interface, const char* call, const char* given, const std::string& answer,
          Names names);

/// Calls a function of C with a null pointer in the place of each argument that has a name.
template <class Judge, class... Arguments>
void try_nulls(const Judge& judge, const char* call, dynmesh_status (*function)(Arguments...),
               const std::array<const char*, sizeof...(Arguments)>& names,
               std::type_identity_t<Arguments>... given) {
  const auto try_null = [&]<std::size_t i>() {
    if constexpr (std::is_pointer_v<std::tuple_element_t<i, std::tuple<Arguments...>>>) {
      if (names[i] == nullptr) return;
      std::tuple<Arguments...> arguments(given...);
      std::get<i>(arguments) = nullptr;
      const std::string argument = names[i];
      judge(call, ("`" + argument + "`: a null pointer").c_str(), {argument + ":", "null pointer"},
            std::apply(function, arguments));
    }
  };
  [&]<std::size_t... i>(std::index_sequence<i...>) { (try_null.template operator()<i>(), ...); }
  (std::index_sequence_for<Arguments...>{});
}

void try_cpp(World& world);
void try_c(World& world);
void try_c_tracker(World& world);

}  // namespace dynmesh::testing
