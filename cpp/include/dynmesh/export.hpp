/// What a shared library of dynmesh offers. Elsewhere than on Windows, a static library is compiled
/// alike, so that both have the same object files.
#pragma once

#if defined(DYNMESH_STATIC_DEFINE)
#define DYNMESH_EXPORT
#elif !defined(_WIN32)
#define DYNMESH_EXPORT __attribute__((visibility("default")))
#elif defined(dynmesh_EXPORTS)
#define DYNMESH_EXPORT __declspec(dllexport)
#else
#define DYNMESH_EXPORT __declspec(dllimport)
#endif
