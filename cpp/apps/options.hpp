/// The command line of dynmesh-complete.
#pragma once

#include <dynmesh/settings.hpp>
#include <optional>
#include <string>
#include <vector>

namespace dynmesh::app {

struct Options {
  std::optional<std::string> template_path, input, output;
  std::vector<std::string> training;
  Settings settings;
  bool report = false;
  bool overwrite = false;
};

/// Returns nothing if --help or --version has been printed. Throws UsageError.
std::optional<Options> parse_options(int argc, char** argv);

}  // namespace dynmesh::app
