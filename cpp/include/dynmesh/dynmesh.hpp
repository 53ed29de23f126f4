/// dynmesh: real-time completion of dynamic meshes. This header includes the whole C++ interface.
///
/// Before version 1.0, every minor version may change the interface and the binary interface.
#pragma once

#include <dynmesh/baselines.hpp>
#include <dynmesh/completer.hpp>
#include <dynmesh/frame_stream.hpp>
#include <dynmesh/metrics.hpp>
#include <dynmesh/quality.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <dynmesh/version.hpp>
