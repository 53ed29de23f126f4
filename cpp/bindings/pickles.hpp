/// Pickles of the Python classes of completer and tracker, and of their reports.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <dynmesh/tracker.hpp>
#include <dynmesh/version.hpp>
#include <memory>
#include <string>
#include <tuple>
#include <utility>

namespace dynmesh {

namespace py = pybind11;

template <class Any>
[[noreturn]] void refuse_pickle() {
  throw py::value_error("state: not a pickled " + std::string(Any::name));
}

/// Makes an object from what `pickled` returned.
template <class Any>
std::unique_ptr<Any> unpickled(const py::tuple& parts) {
  if (parts.size() != 4) refuse_pickle<Any>();
  std::unique_ptr<Any> made;
  try {
    made = std::make_unique<Any>(py::object(parts[0]), py::object(parts[1]),
                                 py::kwargs(py::object(parts[2])));
  } catch (const py::reference_cast_error&) {
    throw py::value_error("state: has settings that dynmesh " DYNMESH_VERSION
                          " does not know; create the " +
                          std::string(Any::name) + " anew");
  }
  made->restore(parts[3]);
  return made;
}

/// `Any` has `pickled`, `restore` and a `name`.
template <class Any>
void bind_pickle(py::class_<Any>& bound) {
  bound.def(py::pickle(
      // The attributes of a subclass in Python are its own.
      [](const py::object& self) {
        return py::make_tuple(self.cast<Any&>().pickled(),
                              py::getattr(self, "__dict__", py::dict()));
      },
      [](const py::tuple& given) {
        if (given.size() != 2 || !py::isinstance<py::tuple>(given[0])) refuse_pickle<Any>();
        return std::pair(unpickled<Any>(py::object(given[0])), py::dict(given[1]));
      }));
}

/// References to all that a report holds.
inline auto members_of(FrameReport& report) {
  auto& [blend, prior_weight, prior_share, first_order_share, factor, rotation, solve] =
      report.stages;
  return std::tie(report.known, report.filled, report.disconnected, report.iterations,
                  report.rejected, report.standard_error, report.seconds, blend, prior_weight,
                  prior_share, first_order_share, factor, rotation, solve);
}

inline auto members_of(TrackingReport& report) {
  auto& [points, far_share, disagreeing, distance] = report.agreement;
  return std::tuple_cat(
      members_of(static_cast<FrameReport&>(report)),
      std::tie(points, far_share, disagreeing, distance, report.recovered));
}

template <class... Value>
std::tuple<Value...> values_of(const std::tuple<Value&...>& members) {
  return members;
}

template <class Report>
auto report_pickle() {
  return py::pickle([](Report report) { return py::cast(values_of(members_of(report))); },
                    [](const py::object& state) {
                      Report report;
                      auto members = members_of(report);
                      try {
                        members = state.cast<decltype(values_of(members))>();
                      } catch (const py::cast_error&) {
                        throw py::value_error("state: not that of a pickled report");
                      }
                      return report;
                    });
}

}  // namespace dynmesh
