/// Completers, trackers and training sequences, of float32 and float64 each.
#include <array>
#include <dynmesh/completer.hpp>
#include <dynmesh/tracker.hpp>
#include <memory>
#include <optional>

#include "api/one_at_a_time.hpp"
#include "api/settings_table.hpp"
#include "arrays.hpp"

namespace dynmesh {
namespace {

/// Python may call a completer or a tracker while another thread is using it with the GIL released,
/// which these do not allow.
template <class Object>
struct Shared {
  Object object;
  OneAtATime turns;
};

/// A call of one thread at a time.
template <class Object, class Result, class... Given>
auto alone(Result (*call)(Object&, Given...)) {
  return [call](Shared<Object>& shared, Given... given) -> Result {
    return shared.turns.enter([&] { return call(shared.object, given...); });
  };
}

template <class Settings>
Settings settings_of(const py::dict& given) {
  Settings settings;
  std::size_t n_taken = 0;
  for_each_setting<Settings>(
      [&]<class Value>(const Setting& setting, Value Settings::*member, auto...) {
        if (!given.contains(setting.name)) return;
        ++n_taken;
        const py::object value = given[setting.name];
        try {
          if constexpr (std::is_enum_v<Value>) {
            settings.*member = from_name<Value>(setting.name, value.cast<std::string>());
          } else {
            settings.*member = value.cast<Value>();
          }
        } catch (const py::cast_error&) {
          throw SettingError(setting.name, "is out of range, " + std::string(py::repr(value)));
        }
      });
  if (n_taken < given.size()) throw std::invalid_argument("settings: one of them is not known");
  return settings;
}

template <class Settings>
py::dict default_settings() {
  py::dict defaults;
  for_each_setting<Settings>(
      [&]<class Value>(const Setting& setting, Value Settings::*member, auto...) {
        const Value value = Settings{}.*member;
        if constexpr (std::is_enum_v<Value>) {
          defaults[setting.name] = names_of<Value>()[static_cast<std::size_t>(value)];
        } else {
          defaults[setting.name] = value;
        }
      });
  return defaults;
}

/// Binds what completers and trackers have in common.
template <template <class> class Object, class Real, class Settings>
auto bind_stream(py::module_& module, const char* name) {
  using O = Object<Real>;
  module.def(name, [name](const Exact<Index>& faces, const Exact<Real>& first_frame,
                          const py::dict& given, const Training<Real>* training) {
    const auto settings = settings_of<Settings>(given);
    const py::gil_scoped_release release;
    return std::unique_ptr<Shared<O>>(
        new Shared<O>{training == nullptr ? O(view(faces), view(first_frame), settings)
                                          : O(view(faces), view(first_frame), settings, *training),
                      OneAtATime(name)});
  });
  return py::class_<Shared<O>>(py::handle(), name)
      .def("skip", alone(+[](O& o, Exact<Real>& out) { o.skip(writable(out)); }), Release())
      .def("reset", alone(+[](O& o, const Exact<Real>& frame) { o.reset(view(frame)); }), Release())
      .def("state", alone(+[](O& o) {
             const auto bytes = o.state();
             return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
           }))
      .def("restore", alone(+[](O& o, const py::bytes& state) {
             const std::string_view bytes(state);
             without_gil([&] { o.restore(std::as_bytes(std::span(bytes))); });
           }))
      .def("generation", alone(+[](O& o) { return array_of(o.generation()); }))
      .def("age", alone(+[](O& o) { return array_of(o.age()); }))
      .def("standard_error", alone(+[](O& o) { return array_of(o.standard_error()); }))
      // What follows may be called at any time.
      .def("report", [](const Shared<O>& shared) { return fields_of(shared.object.report()); })
      .def("n_frames", [](const Shared<O>& shared) { return shared.object.n_frames(); })
      .def("n_edges", [](const Shared<O>& shared) { return shared.object.n_edges(); })
      .def("topology", [](const Shared<O>& shared) {
        constexpr std::array kinds = {"degenerate", "duplicate", "flipped", "non_manifold_edge",
                                      "non_manifold_vertex"};
        const TopologyReport& found = shared.object.topology();
        py::list refused;
        for (const RefusedFace& face : found.refused_faces) {
          refused.append(py::make_tuple(face.index, kinds.at(static_cast<std::size_t>(face.kind)),
                                        face.reason));
        }
        return py::make_tuple(found.components, found.isolated_vertices, found.boundary_edges,
                              refused);
      });
}

template <class Real>
void bind_streams_of(py::module_& module) {
  module.def("training",
             [](const Exact<Real>& first_frame) { return Training<Real>(rows_in(first_frame)); });
  py::class_<Training<Real>>(py::handle(), "training")
      .def("add",
           [](Training<Real>& training, const Exact<Real>& frame) { training.add(view(frame)); })
      .def("frames", [](const Training<Real>& training) {
        py::list frames;
        for (const auto& frame : training.frames()) {
          frames.append(array_of(frame).reshape({-1, 3}));
        }
        return frames;
      });

  using C = Completer<Real>;
  bind_stream<Completer, Real, Settings>(module, "completer")
      .def("push",
           alone(+[](C& c, const Exact<Real>& points, const std::optional<Exact<bool>>& known,
                     Exact<Real>& out) {
             known ? c.push(view(points), view(*known), writable(out))
                   : c.push(view(points), writable(out));
           }),
           Release())
      .def("push_sparse",
           alone(
               +[](C& c, const Exact<Index>& indices, const Exact<Real>& points, Exact<Real>& out) {
                 const auto n = static_cast<std::size_t>(indices.size());
                 c.push_sparse({indices.data(), n}, view(points), writable(out));
               }),
           Release());

  using T = Tracker<Real>;
  bind_stream<Tracker, Real, TrackerSettings>(module, "tracker")
      .def("push",
           alone(+[](T& t, const Exact<Real>& points, const std::optional<Exact<Real>>& normals,
                     const std::optional<Exact<Real>>& viewpoints,
                     const std::optional<Exact<Real>>& colours, Exact<Real>& out) {
             t.push(scan_of(points, normals, viewpoints, colours), writable(out));
           }),
           Release())
      .def("push_depth", alone(+[](T& t, const Images& images, Exact<Real>& out) {
             t.push_depth(view(images), writable(out));
           }),
           Release())
      .def("observed", alone(+[](T& t) { return array_of(t.observed()); }))
      .def("agreement_of_sensors", alone(+[](T& t) {
             py::list found;
             for (const Agreement& one : t.agreement_of_sensors()) found.append(fields_of(one));
             return found;
           }));
}

}  // namespace

void bind_streams(py::module_& module) {
  module.def("default_settings", &default_settings<Settings>);
  module.def("default_tracker_settings", &default_settings<TrackerSettings>);
  bind_streams_of<float>(module);
  bind_streams_of<double>(module);
}

}  // namespace dynmesh
