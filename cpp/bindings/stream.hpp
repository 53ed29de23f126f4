/// What the Python classes of completer and tracker share.
#pragma once

#include <pybind11/stl.h>

#include <dynmesh/completer.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "arrays.hpp"
#include "bindings.hpp"
#include "pickles.hpp"
#include "scalars.hpp"
#include "stream/one_at_a_time.hpp"
#include "stream/settings_table.hpp"
#include "support/wrapped_text.hpp"
#include "training.hpp"

namespace dynmesh {

constexpr const char* training_name = "training";  // the argument beside the settings

/// The value of a setting that is given in Python.
template <class Value>
Value setting_value(const char* name, py::handle given) {
  if constexpr (std::is_enum_v<Value>) {
    return from_name<Value>(name, text_argument(name, given));
  } else if constexpr (std::is_same_v<Value, bool>) {
    return truth_argument(name, given);
  } else if constexpr (std::is_same_v<Value, Index>) {
    return integer_argument(name, given);
  } else {
    if (given.is_none()) return std::nullopt;
    return number_argument(name, given);
  }
}

template <class Value>
py::object python_value(const Value& value) {
  if constexpr (std::is_enum_v<Value>) {
    return py::str(names_of<Value>[static_cast<std::size_t>(value)]);
  } else {
    return py::cast(value);
  }
}

/// The settings among the keywords of a constructor.
template <class Settings>
Settings settings_of(const py::kwargs& given) {
  Settings settings;
  std::size_t n_taken = given.contains(training_name) ? 1 : 0;
  try {
    for_each_setting<Settings>(
        [&]<class Value>(const Setting& setting, Value Settings::*member, auto...) {
          if (!given.contains(setting.name)) return;
          settings.*member = setting_value<Value>(setting.name, given[setting.name]);
          ++n_taken;
        });
  } catch (const ValueRefused& error) {
    throw SettingError(error.argument(), error.reason());
  }
  // Continue with the overload that refuses calls: see calls.cpp.
  if (n_taken < given.size()) throw py::reference_cast_error();
  return settings;
}

template <class T>
py::array_t<T> array_of(std::span<const T> values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

/// (m, 3)
inline py::array array_of(const Faces& faces) {
  return py::array_t<Index>({static_cast<py::ssize_t>(faces.count), py::ssize_t{3}}, faces.data);
}

/// A Python class for both precisions of Completer or Tracker. Python may call it from any thread
/// while another thread is using it with the GIL released, which these do not allow. Such calls are
/// refused.
template <template <class> class Object, class Settings>
class AnyStream {
 public:
  AnyStream(const py::object& faces, const py::object& first_frame, const py::kwargs& given,
            const char* name)
      : turns_(name) {
    const Settings settings = settings_of<Settings>(given);
    const py::object training =
        given.contains(training_name) ? py::object(given[training_name]) : py::none();
    const py::array frame = to_positions("first_frame", first_frame);
    if (frame.itemsize() == sizeof(float)) {
      construct<float>(faces, frame, settings, training);
    } else {
      construct<double>(faces, frame, settings, training);
    }
  }

  /// Everything that makes an equal object: what was given to the constructor, and the state.
  py::tuple pickled() {
    py::dict given = settings();
    given[training_name] = training_;
    return py::make_tuple(faces_, first_frame_, given, state());
  }

  py::object skip(const py::object& out) {
    return exclusively([&]<class Real>(Object<Real>& object) {
      OutputArgument<Real> output(out, object.n_vertices());
      released([&] { object.skip(output.view()); });
      return output.array();
    });
  }

  void reset(const py::object& frame) {
    exclusively([&]<class Real>(Object<Real>& object) {
      const PointsArgument<Real> given("frame", frame, "(k, 3)");
      released([&] { object.reset(given.view()); });
    });
  }

  py::bytes state() {
    return exclusively([](auto& object) {
      const auto bytes = object.state();
      return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    });
  }
  void restore(const py::object& state) {
    exclusively([&](auto& object) { object.restore(BytesArgument("state", state).view()); });
  }

  py::array_t<Index> generation() {
    return exclusively([](auto& object) { return array_of(object.generation()); });
  }
  py::array_t<Index> age() {
    return exclusively([](auto& object) { return array_of(object.age()); });
  }
  py::array standard_error() {
    return exclusively([](auto& object) -> py::array { return array_of(object.standard_error()); });
  }
  auto report() {
    return exclusively([](auto& object) { return object.report(); });
  }
  std::size_t n_frames() {
    return exclusively([](auto& object) { return object.n_frames(); });
  }

  // Properties that never change can be read at any time.
  [[nodiscard]] py::dict settings() const {
    py::dict found;
    const Settings& chosen = std::visit(
        [](const auto& object) -> const Settings& { return object->settings(); }, object_);
    for_each_setting<Settings>([&](const Setting& setting, auto member, auto...) {
      found[setting.name] = python_value(chosen.*member);
    });
    return found;
  }
  [[nodiscard]] TopologyReport topology() const {
    return std::visit([](const auto& object) { return object->topology(); }, object_);
  }
  [[nodiscard]] std::size_t n_vertices() const {
    return std::visit([](const auto& object) { return object->n_vertices(); }, object_);
  }
  [[nodiscard]] std::size_t n_edges() const {
    return std::visit([](const auto& object) { return object->n_edges(); }, object_);
  }
  [[nodiscard]] py::dtype dtype() const {
    return object_.index() == 0 ? py::dtype::of<float>() : py::dtype::of<double>();
  }

 protected:
  template <class Call>
  static void released(const Call& call) {
    const py::gil_scoped_release release;
    call();
  }

  template <class Call>
  auto exclusively(const Call& call) {
    return turns_.enter(
        [&] { return std::visit([&](auto& object) { return call(*object); }, object_); });
  }

 private:
  template <class Real>
  void construct(const py::object& faces, const py::array& first_frame, const Settings& settings,
                 const py::object& training) {
    const PointsArgument<Real> frame("first_frame", first_frame, "(k, 3)");
    const FacesArgument triangles(faces, frame.view().count);
    if (training.is_none()) {
      released([&] {
        object_ = std::make_unique<Object<Real>>(triangles.view(), frame.view(), settings);
      });
    } else {
      const auto trained = training_of<Real>(training, frame.view().count);
      released([&] {
        object_ = std::make_unique<Object<Real>>(triangles.view(), frame.view(), settings, trained);
      });
      training_ = array_of(trained);
    }
    faces_ = array_of(triangles.view());
    first_frame_ = py::array_t<Real, py::array::c_style>(first_frame.attr("copy")());
  }

  std::variant<std::unique_ptr<Object<float>>, std::unique_ptr<Object<double>>> object_;
  OneAtATime turns_;
  // For pickles: neither the object nor its state holds them as they were given.
  py::array faces_, first_frame_;
  py::object training_ = py::none();  // the frames that are kept
};

/// A value as it is written in Python.
template <class Value>
std::string python_text(const Value& value) {
  return std::string(py::repr(python_value(value)));
}

/// The docstring of the constructor, which begins with its signature.
template <class Settings>
std::string init_doc_of(const char* summary) {
  std::string arguments = "faces, first_frame, *, ";
  for_each_setting<Settings>([&](const Setting& setting, auto member, auto...) {
    arguments += setting.name + ("=" + python_text(Settings{}.*member)) + ", ";
  });
  return "__init__(self, " + arguments + "training=None)\n--\n\n" + summary;
}

/// What the docstring of a class says of the settings.
template <class Settings>
std::string settings_doc() {
  std::string doc;
  for_each_setting<Settings>([&]<class Value>(const Setting& setting, Value Settings::*member,
                                              auto...) {
    std::string text = std::string(setting.help) + " " + setting.more;
    if (*setting.without != 0) text += std::string("If False: ") + setting.without;
    if constexpr (std::is_same_v<Value, Index>) {
      text +=
          " From " + std::to_string(setting.least) + " to " + std::to_string(setting.most) + ".";
    }
    if (setting.method) {
      const auto method = names_of<Method>.at(static_cast<std::size_t>(*setting.method));
      text += " Requires \"" + std::string(method) + "\".";
    }
    text += " The default is " + python_text(Settings{}.*member) + ".";
    doc += wrapped_text("    " + std::string(setting.name) + ": ", text, 8, 100);
  });
  return doc;
}

/// The table of settings, for dynmesh.settings.
template <class Settings>
py::list setting_table() {
  py::list rows;
  for_each_setting<Settings>(
      [&]<class Value>(const Setting& setting, Value Settings::*member, auto...) {
        py::dict row;
        row["name"] = setting.name;
        row["default"] = python_value(Settings{}.*member);
        row["help"] = setting.help;
        row["metavar"] = setting.value;
        row["method"] = setting.method ? python_value(*setting.method) : py::none();
        if constexpr (std::is_same_v<Value, Index>) {
          row["least"] = setting.least;
          row["most"] = setting.most;
        }
        if constexpr (std::is_enum_v<Value>) {
          row["choices"] = py::tuple(py::cast(names_of<Value>));
        }
        rows.append(row);
      });
  return rows;
}

/// The docstrings that differ.
struct StreamDocs {
  const char *init, *skip, *reset, *state, *restore, *generation, *standard_error, *report,
      *n_frames;
};

/// Binds what AnyStream has.
template <class Any>
void bind_stream(py::class_<Any>& bound, const StreamDocs& docs) {
  bind_pickle(bound);
  bound
      .def(py::init<const py::object&, const py::object&, const py::kwargs&>(), py::arg("faces"),
           py::arg("first_frame"), docs.init)
      .def("skip", &Any::skip, py::kw_only(), py::arg("out") = py::none(), docs.skip)
      .def("reset", &Any::reset, py::arg("frame"), docs.reset)
      .def("state", &Any::state, docs.state)
      .def("restore", &Any::restore, py::arg("state"), docs.restore)
      .def_property_readonly("generation", &Any::generation, docs.generation)
      .def_property_readonly("age", &Any::age,
                             "(k,) int32: the number of frames since the vertex was last observed.")
      .def_property_readonly("standard_error", &Any::standard_error, docs.standard_error)
      .def_property_readonly("report", &Any::report, docs.report)
      .def_property_readonly("topology", &Any::topology, "The TopologyReport of the mesh.")
      .def_property_readonly("settings", &Any::settings,
                             "dict: All settings with their values, by name.")
      .def_property_readonly("n_frames", &Any::n_frames, docs.n_frames)
      .def_property_readonly("n_vertices", &Any::n_vertices, "The number of vertices, k.")
      .def_property_readonly("n_edges", &Any::n_edges, "The number of edges of the mesh.")
      .def_property_readonly("dtype", &Any::dtype, "float32 or float64, the dtype of first_frame.");
}

}  // namespace dynmesh
