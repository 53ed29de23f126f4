/// dynmesh-complete: fills in the missing vertices of a stream of frames.
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <exception>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "frame_files.hpp"
#include "options.hpp"
#include "support/paths.hpp"
#include "system.hpp"

namespace {

using dynmesh::app::caught_signal;
using dynmesh::app::DataError;
using dynmesh::app::FrameReader;
using dynmesh::app::FrameWriter;
using dynmesh::app::Options;
using dynmesh::app::UsageError;

void print(const dynmesh::FrameReport& report, std::size_t frame) {
  std::fprintf(stderr,
               "{\"frame\": %zu, \"known\": %zu, \"filled\": %zu, \"disconnected\": %zu, "
               "\"rejected\": %zu, \"iterations\": %zu, \"seconds\": %.9f, \"blend\": %.9g, "
               "\"prior_weight\": %.9g, \"prior_share\": %.9g, "
               "\"first_order_share\": %.9g, \"standard_error\": %.9g}\n",
               frame, report.known, report.filled, report.disconnected, report.rejected,
               report.iterations, report.seconds, report.stages.blend, report.stages.prior_weight,
               report.stages.prior_share, report.stages.first_order_share, report.standard_error);
}

/// Returns what `call` returns. Adds `where` to the message of an error of the library.
template <class Call>
auto with_context(const std::string& where, const Call& call) {
  try {
    return call();
  } catch (const std::invalid_argument& error) {
    throw DataError(where + ": " + error.what());
  }
}

/// Refuses unknown formats, and an output that would overwrite what is read.
void check_files(const Options& options) {
  (void)dynmesh::app::format_of(*options.input);
  (void)dynmesh::app::format_of(*options.output);
  const auto check = [&](const std::string& path, const char* role) {
    std::error_code missing;
    const auto output = dynmesh::path_of(*options.output);
    if (!std::filesystem::equivalent(dynmesh::path_of(path), output, missing)) return;
    throw UsageError(*options.output + ": is also " + role +
                     ", which would be overwritten; choose another output");
  };
  check(*options.input, "the input file");
  for (const std::string& path : options.training) {
    (void)dynmesh::app::format_of(path);
    check(path, "a training sequence");
  }
}

/// Reads the frames of all files. If a signal interrupts reading, frames are missing.
dynmesh::Training<float> read_training(const std::vector<std::string>& paths,
                                       std::size_t n_vertices) {
  dynmesh::Training<float> training(n_vertices);
  std::vector<float> frame(3 * n_vertices);
  for (const std::string& path : paths) {
    FrameReader reader(path, n_vertices);
    std::size_t number = 0;
    while (caught_signal() == 0 && reader.read(frame)) {
      ++number;
      const auto counted = "training: frame " + std::to_string(training.n_added()) + ": ";
      try {
        training.add({frame.data(), n_vertices});
      } catch (const std::invalid_argument& error) {
        // The library counts the frames of all files together, from 0.
        std::string reason = error.what();
        if (reason.starts_with(counted)) reason.erase(0, counted.size());
        throw DataError(reader.name() + ": frame " + std::to_string(number) + ": " + reason);
      }
    }
    if (number == 0 && caught_signal() == 0) throw DataError(reader.name() + ": has no frames");
  }
  return training;
}

/// Returns a completer that has read the training sequence, if there is one, or nothing if a signal
/// interrupts reading.
std::optional<dynmesh::Completer<float>> make_completer(const Options& options) {
  const dynmesh::TemplateMesh mesh = dynmesh::read_template(*options.template_path);
  const auto make = [&](const auto&... training) {
    return dynmesh::Completer<float>(mesh.triangles(), mesh.points(), options.settings,
                                     training...);
  };
  if (options.training.empty()) {
    return with_context(*options.template_path, [&] { return make(); });
  }
  const auto training = read_training(options.training, mesh.points().count);
  if (caught_signal() != 0) return {};
  try {
    return make(training);
  } catch (const std::invalid_argument& error) {
    constexpr std::string_view argument = "training: ";
    const std::string reason = error.what();
    if (!reason.starts_with(argument)) throw DataError(*options.template_path + ": " + reason);
    std::string paths = options.training[0];
    for (std::size_t i = 1; i < options.training.size(); ++i) {
      paths += ", " + options.training[i];
    }
    throw DataError(paths + ": " + reason.substr(argument.size()));
  }
}

void complete(const Options& options) {
  check_files(options);
  auto made = make_completer(options);
  if (!made) return;
  dynmesh::Completer<float>& completer = *made;
  FrameReader reader(*options.input, completer.n_vertices());
  FrameWriter writer(*options.output, completer.n_vertices(), reader.timing(), options.overwrite);
  std::vector<float> frame(3 * completer.n_vertices());
  const dynmesh::Points<float> points(frame.data(), completer.n_vertices());
  std::optional<DataError> damage;
  for (std::size_t number = 1;; ++number) {
    dynmesh::FrameReport report;
    try {
      if (caught_signal() != 0 || !reader.read(frame)) break;
      report = with_context(reader.name() + ": frame " + std::to_string(number),
                            [&] { return completer.push(points, points); });
    } catch (const DataError& error) {
      damage = error;  // keep the frames that were completed before it
      break;
    }
    if (options.report) print(report, number);
    writer.write(frame);
  }
  if (damage && writer.n_frames() == 0)
    throw DataError(*damage);  // leave an existing file unchanged
  writer.finish();
  if (damage) throw DataError(*damage);
}

}  // namespace

int main(int argc, char** argv) {
  dynmesh::app::stop_on_signals();
  try {
    dynmesh::app::Arguments arguments(argc, argv);
    if (const auto options = dynmesh::app::parse_options(arguments.count(), arguments.values())) {
      complete(*options);
    }
    if (caught_signal() != 0) {
      std::fprintf(
          stderr, "dynmesh-complete: interrupted; all frames completed so far have been written\n");
      return 128 + caught_signal();
    }
    return 0;
  } catch (const UsageError& error) {
    std::fprintf(stderr, "dynmesh-complete: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "dynmesh-complete: %s\n", error.what());
    return 1;
  }
}
