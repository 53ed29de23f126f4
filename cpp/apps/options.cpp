#include "options.hpp"

#include <getopt.h>

#include <algorithm>
#include <cstdio>
#include <deque>
#include <dynmesh/version.hpp>
#include <stdexcept>
#include <system_error>
#include <type_traits>
#include <vector>

#include "frame_files.hpp"
#include "stream/settings_table.hpp"
#include "support/parse_number.hpp"
#include "support/wrapped_text.hpp"

namespace dynmesh::app {
namespace {

constexpr const char* help_before_settings =
    R"(Usage: dynmesh-complete --template MESH --input FRAMES --output FRAMES [OPTION]...

Completes the missing vertices of every frame of a dynamic mesh, from that frame and
earlier frames only. One frame is in memory at a time.

  --template MESH    the complete frame 0 and the faces: .obj, .ply or .off
  --input FRAMES     frames 1, 2, ... with the vertices of MESH in the same order;
                     a vertex with a coordinate that is NaN or infinite is missing
  --output FRAMES    one completed frame for each input frame
  --training FRAMES (method detail) complete frames of this subject, or of one like it
                     with the same vertices, from which the method learns how its shape
                     varies; 3 or more, of which 75 at most are kept; may be repeated

FRAMES is a point cache (.pc2), or raw little-endian float32, x y z for each vertex,
frame after frame (.raw, .f32, .float32, .bin, .dat or no suffix). "-" is standard
input or output, raw.

)";

constexpr const char* help_after_settings =
    R"(  --report           print one JSON line per frame to standard error: known, filled,
                     disconnected, rejected, iterations, seconds, blend, prior_weight, prior_share,
                     first_order_share, standard_error (root mean square of the filled-in
                     vertices, with --uncertainty)
  --overwrite        replace an existing output file
  -h, --help         print this text
  --version          print the version

If the input ends within a frame or contains a frame that cannot be completed, or if
the program is interrupted (Ctrl-C), all frames before that are completed and written.
Exit code: 0 success; 1 the data or a file is not valid; 2 the command line is not
valid; 130 or 143 interrupted.

Examples:
  dynmesh-complete --template body.obj --input partial.pc2 --output completed.pc2
  sensor | dynmesh-complete --template body.ply --input - --output - | renderer
)";

/// `kind` is what the text should be, as in "is not a whole number".
template <class Number>
Number parse(const char* option, const std::string& text, const char* kind) {
  Number value = 0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = parse_number(text.data(), end, value);
  if (stopped != end || error == std::errc::invalid_argument) {
    throw UsageError(std::string(option) + ": '" + text + "' is not a " + kind);
  }
  if (error != std::errc()) {
    throw UsageError(std::string(option) + ": " + text + " is out of range");
  }
  return value;
}

/// What an option of a setting is called. One that is on by default is turned off by --no-....
template <class Value>
std::string option_of(const Setting& setting, Value Settings::*member) {
  std::string name = setting.name;
  std::ranges::replace(name, '_', '-');
  if constexpr (std::is_same_v<Value, bool>) {
    if (Settings{}.*member) return "no-" + name;
  }
  return name;
}

template <class Value>
Value value_of(const Setting& setting, Value Settings::*member, const char* text) {
  const std::string option = "--" + option_of(setting, member);
  if constexpr (std::is_same_v<Value, bool>) {
    return !(Settings{}.*member);
  } else if constexpr (std::is_enum_v<Value>) {
    return from_name<Value>(setting.name, text);
  } else if constexpr (std::is_same_v<Value, Index>) {
    return parse<Index>(option.c_str(), text, "whole number");
  } else {
    return parse<double>(option.c_str(), text, "number");
  }
}

/// What a help text says of a default; truth values have options that only change it.
template <class Value>
std::string default_of(const Value& value) {
  if constexpr (std::is_enum_v<Value>) {
    return " The default is '" + std::string(names_of<Value>[static_cast<std::size_t>(value)]) +
           "'.";
  } else if constexpr (std::is_same_v<Value, Index>) {
    return " The default is " + std::to_string(value) + ".";
  }
  return "";
}

void print_help() {
  constexpr std::size_t indent = 21;
  constexpr std::size_t width = 86;
  std::string text = help_before_settings;
  for_each_setting([&](const Setting& setting, auto member, auto...) {
    const std::string head = "  --" + option_of(setting, member) + ' ' + setting.value;
    std::string sentence = setting.help;
    if constexpr (std::is_same_v<decltype(member), bool Settings::*>) {
      if (Settings{}.*member) sentence = setting.without;
    }
    sentence += default_of(Settings{}.*member);
    if (setting.method) {
      sentence = "(method " +
                 std::string(names_of<Method>.at(static_cast<std::size_t>(*setting.method))) +
                 ") " + sentence;
    }
    text += wrapped_text(head, sentence, indent, width);
  });
  std::fputs((text + help_after_settings).c_str(), stdout);
}

/// Converts "extra_iterations: ..." of the library to "--extra-iterations: ...".
std::string as_option(std::string message) {
  std::replace(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(message.find(':')),
               '_', '-');
  return "--" + message;
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv) {
  enum : int { template_path = 256, input, output, training, report, overwrite, first_setting };
  std::vector<option> known = {{"template", required_argument, nullptr, template_path},
                               {"input", required_argument, nullptr, input},
                               {"output", required_argument, nullptr, output},
                               {"training", required_argument, nullptr, training},
                               {"report", no_argument, nullptr, report},
                               {"overwrite", no_argument, nullptr, overwrite},
                               {"help", no_argument, nullptr, 'h'},
                               {"version", no_argument, nullptr, 'v'}};
  std::deque<std::string> names;  // which the options point to
  for_each_setting([&]<class Value>(const Setting& setting, Value Settings::*member, auto...) {
    const int takes = std::is_same_v<Value, bool> ? no_argument : required_argument;
    names.push_back(option_of(setting, member));
    known.push_back(
        {names.back().c_str(), takes, nullptr, first_setting + static_cast<int>(names.size()) - 1});
  });
  known.push_back({nullptr, 0, nullptr, 0});
  Options options;
  try {
    for (int c = 0; (c = getopt_long(argc, argv, "h", known.data(), nullptr)) != -1;) {
      switch (c) {
        case template_path:
          options.template_path = optarg;
          break;
        case input:
          options.input = optarg;
          break;
        case output:
          options.output = optarg;
          break;
        case training:
          options.training.emplace_back(optarg);
          break;
        case report:
          options.report = true;
          break;
        case overwrite:
          options.overwrite = true;
          break;
        case 'h':
          print_help();
          return {};
        case 'v':
          std::puts("dynmesh-complete " DYNMESH_VERSION);
          return {};
        default: {
          if (c < first_setting)
            throw UsageError("see dynmesh-complete --help");  // getopt says why
          int number = first_setting;
          for_each_setting([&](const Setting& setting, auto member, auto...) {
            if (number++ == c) options.settings.*member = value_of(setting, member, optarg);
          });
        }
      }
    }
    check_settings(options.settings);
    if (!options.training.empty() && options.settings.method != Method::detail) {
      throw SettingError("training", "requires --method detail");
    }
  } catch (const std::invalid_argument& error) {
    throw UsageError(as_option(error.what()));
  }
  if (optind < argc)
    throw UsageError(std::string("unexpected argument '") + argv[optind] + "'; see --help");
  if (!options.template_path) throw UsageError("--template is missing; see --help");
  if (!options.input) throw UsageError("--input is missing; see --help");
  if (!options.output) throw UsageError("--output is missing; see --help");
  if (std::ranges::count(options.training, "-") + (*options.input == "-" ? 1 : 0) > 1) {
    throw UsageError("--training: standard input ('-') can be read only once");
  }
  return options;
}

}  // namespace dynmesh::app
