/// dynmesh: real-time completion of dynamic meshes. This header includes all others.
#pragma once

#include <dynmesh/baselines.hpp>
#include <dynmesh/completer.hpp>
#include <dynmesh/metrics.hpp>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <dynmesh/version.hpp>
