/// dynmesh for C, and for all that can call C: the same completer as in completer.hpp.
///
/// Status. A function that can fail returns a dynmesh_status. Where that is not DYNMESH_OK, nothing
/// has changed: the completer is as it was, nothing was written except as stated, and
/// dynmesh_last_message() says what is wrong, where, and which value. This holds for
/// DYNMESH_OUT_OF_MEMORY, too. No exception leaves a function, and nothing is printed.
///
/// Arguments. Pointers must not be null unless it says so; a null one, a negative number and
/// whatever the completer can see of bad data is refused with DYNMESH_INVALID_ARGUMENT. What it
/// cannot see is the caller's to guarantee: that counts and strides describe memory that is there,
/// and that a handle is alive.
/// The values of positions, indices and masks, and the bytes of a mesh file or a state, may be
/// anything. The library never keeps a pointer that it was given.
///
/// Threads. One thread at a time for each completer: while one is inside, whatever another calls
/// is refused with DYNMESH_IN_USE, at once and without harm. dynmesh_n_vertices,
/// dynmesh_state_size, dynmesh_topology and dynmesh_refused_face tell what never changes and may be
/// called at any time; dynmesh_destroy only when nobody is inside or will be. Different completers
/// are independent.
///
/// Memory. dynmesh_push, dynmesh_push_sparse and dynmesh_skip allocate nothing where they succeed,
/// but for method detail where its factor is larger than all before.
///
/// Structs lie in memory as C lays them out. Before version 1.0 every minor version may change this
/// interface: whoever declares it in another language should compare dynmesh_version().
#ifndef DYNMESH_DYNMESH_H
#define DYNMESH_DYNMESH_H

// NOLINTBEGIN(modernize-deprecated-headers, modernize-use-using): this is C as well.
#include <stdint.h>

// These two hold macros alone.
#include <dynmesh/export.hpp>
#include <dynmesh/version.hpp>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  DYNMESH_OK = 0,
  DYNMESH_INVALID_ARGUMENT = 1,
  DYNMESH_OUT_OF_MEMORY = 2,    ///< or of threads
  DYNMESH_UNREADABLE_FILE = 3,  ///< of dynmesh_read_template alone
  DYNMESH_INTERNAL_ERROR = 4,   ///< a fault of dynmesh
  DYNMESH_IN_USE = 5            ///< another thread is inside this completer
};
typedef int32_t dynmesh_status;

/// What was wrong with the last call on this thread that failed, in UTF-8; "" where none has. A
/// longer message is cut to at most 1023 bytes, between two characters. Paths stand in it as they
/// were given. Valid until the next call on this thread that fails.
DYNMESH_EXPORT const char* dynmesh_last_message(void);

/// The version of the library, "major.minor.patch"; DYNMESH_VERSION is that of this header.
DYNMESH_EXPORT const char* dynmesh_version(void);

// Arrays in the caller's memory ------------------------------------------------------------------

enum { DYNMESH_FLOAT32 = 32, DYNMESH_FLOAT64 = 64 };

/// Positions that are read: coordinate c of row i is element i * row_stride + c * column_stride.
/// Strides count elements, not bytes, and may be negative. x y z one after another: 3 and 1, or, as
/// 0 means tightly packed, 0 and 0. `data` is aligned as its elements are, and may be null where
/// `count` is 0.
typedef struct dynmesh_points {
  const void* data;
  int64_t count;          ///< rows
  int64_t row_stride;     ///< 0: 3, for which column_stride must be 1 or 0
  int64_t column_stride;  ///< 0: 1
  int32_t type;           ///< DYNMESH_FLOAT32 or DYNMESH_FLOAT64
} dynmesh_points;

/// Positions that are written. The fields are those of dynmesh_points.
typedef struct dynmesh_output {
  void* data;
  int64_t count;
  int64_t row_stride;
  int64_t column_stride;
  int32_t type;
} dynmesh_output;

/// A byte for each vertex: not zero where it was observed. `stride` counts bytes and may be
/// negative; tightly packed: 1 or 0.
typedef struct dynmesh_mask {
  const uint8_t* data;
  int64_t count;
  int64_t stride;
} dynmesh_mask;

// Settings ---------------------------------------------------------------------------------------

enum { DYNMESH_METHOD_MOTION = 0, DYNMESH_METHOD_DETAIL = 1 };
enum { DYNMESH_UNSEEN_HOLD = 0, DYNMESH_UNSEEN_FOLLOW = 1 };

/// How a completer works. Call dynmesh_default_settings first, then change fields: the defaults are
/// not zero, and a struct of zeros is refused.
///
///     dynmesh_settings settings;
///     dynmesh_default_settings(&settings, sizeof settings);
///     settings.extra_iterations = 10;
typedef struct dynmesh_settings {
  /// sizeof(dynmesh_settings), by which the library knows the fields that the caller knows: later
  /// versions may append some. dynmesh_default_settings sets it; any other value is refused.
  int64_t size;

  /// Default: DYNMESH_METHOD_MOTION, the paper's averaged motion vectors. DYNMESH_METHOD_DETAIL
  /// keeps the shape of frame 0 and of the last frame, turned with the motion: a fraction of the
  /// error, in milliseconds where the other takes tenths of one. It refuses other than the defaults
  /// of `revisit` and `extra_iterations`.
  int32_t method;

  /// Default: 1. Not zero: every iteration estimates all vertices reached so far. 0: each is
  /// estimated once, when it is reached, and errors feed on themselves from frame to frame.
  int32_t revisit;

  /// Default: 0. Iterations after the one that reaches the last vertex, up to 1 000 000. Ten take
  /// off a third of the error on many sequences, and add to it on some; without `revisit` they
  /// change nothing.
  int32_t extra_iterations;

  /// Default: DYNMESH_UNSEEN_FOLLOW. What becomes of vertices that no chain of edges ties to a
  /// known one. Follow: their component moves rigidly, as the surface nearest to it in frame 0
  /// does. Hold: they stay where they were.
  int32_t unseen;

  /// Default: NaN, none. Standard deviation of the known positions, in their unit, positive; they
  /// move too then. DYNMESH_METHOD_MOTION takes them exactly and refuses any number.
  double noise;

  /// Default: 0. Not zero: known positions that contradict their neighbours are taken as
  /// unknown, estimated, and counted as `rejected`. DYNMESH_METHOD_MOTION refuses it.
  int32_t reject_outliers;

  /// Default: 1. Threads that a frame may use, the caller's among them, up to 256. The others sleep
  /// between frames. They are used for meshes of 23 553 vertices or more, with
  /// DYNMESH_METHOD_DETAIL of 5 889 or more; the caller completes smaller ones alone. With
  /// `revisit` 0, threads only take and give back positions. Results are the same to the last bit;
  /// whether they come sooner depends on the machine and the mesh: measure it, as script/bench
  /// does.
  int32_t threads;
} dynmesh_settings;

/// Writes the defaults, which are the paper's method, to all fields. `size` is
/// sizeof(dynmesh_settings) where this is called; one that this version of the library does not
/// know is refused, and nothing is written then.
DYNMESH_EXPORT dynmesh_status dynmesh_default_settings(dynmesh_settings* settings, int64_t size);

// The completer ----------------------------------------------------------------------------------

typedef struct dynmesh_completer dynmesh_completer;

/// What happened to one frame; known + filled + unseen is the number of vertices.
typedef struct dynmesh_frame_report {
  int64_t known;
  int64_t filled;      ///< estimated by the method
  int64_t unseen;      ///< not tied to a known vertex: held, or moved rigidly
  int64_t rejected;    ///< observed, but taken as unknown: see reject_outliers
  int64_t iterations;  ///< of the method
  double seconds;      ///< wall time of the call; 0 after dynmesh_reset and dynmesh_restore
} dynmesh_frame_report;

/// Makes a completer of `n_faces` triangles, three vertex indices each, packed, and of frame 0,
/// which must be complete and finite. The type of `first_frame` is that of all later positions.
/// `settings` may be null: the defaults; see dynmesh_default_settings. Free `*completer` with
/// dynmesh_destroy; it is null where this fails.
DYNMESH_EXPORT dynmesh_status dynmesh_create(const int32_t* faces, int64_t n_faces,
                                             const dynmesh_points* first_frame,
                                             const dynmesh_settings* settings,
                                             dynmesh_completer** completer);

/// Null is allowed.
DYNMESH_EXPORT void dynmesh_destroy(dynmesh_completer* completer);

/// Completes the next frame: known vertices exactly as given, everything else estimated. With the
/// setting `noise` known vertices move too; those that `reject_outliers` rejects are estimated.
///
/// `points` has a row for each vertex; rows that are not known are not read. `known` may be null:
/// then rows with a coordinate that is not finite are missing, all others known. A known position
/// must be finite and within 1e18 for float, 1e200 for double.
///
/// `out` has a row for each vertex. It may be the very array that `points` is, or other columns of
/// the same interleaved buffer; output that would overwrite input in any other way is refused.
/// `report` may be null.
DYNMESH_EXPORT dynmesh_status dynmesh_push(dynmesh_completer* completer,
                                           const dynmesh_points* points, const dynmesh_mask* known,
                                           const dynmesh_output* out, dynmesh_frame_report* report);

/// Vertex `indices[i]` was observed at row i of `points`, and no other was. Each index at most
/// once, in any order. `indices` may be null where `n_indices` is 0. The rest as dynmesh_push.
DYNMESH_EXPORT dynmesh_status dynmesh_push_sparse(dynmesh_completer* completer,
                                                  const int32_t* indices, int64_t n_indices,
                                                  const dynmesh_points* points,
                                                  const dynmesh_output* out,
                                                  dynmesh_frame_report* report);

/// A frame of which nothing was observed. The rest as dynmesh_push.
DYNMESH_EXPORT dynmesh_status dynmesh_skip(dynmesh_completer* completer, const dynmesh_output* out,
                                           dynmesh_frame_report* report);

/// This complete frame becomes frame 0, as if the completer were new. Allocates.
DYNMESH_EXPORT dynmesh_status dynmesh_reset(dynmesh_completer* completer,
                                            const dynmesh_points* frame);

/// Writes to `size` how many bytes dynmesh_state writes, the same number for the life of the
/// completer. Allocates nothing.
DYNMESH_EXPORT dynmesh_status dynmesh_state_size(const dynmesh_completer* completer, int64_t* size);

/// Writes all that later frames depend on to `state`, which has room for `size` bytes; a smaller
/// one than dynmesh_state_size tells is refused, and of a larger one the rest is left alone. Two
/// completers that were given the same frames have the same bytes. Allocates.
DYNMESH_EXPORT dynmesh_status dynmesh_state(const dynmesh_completer* completer, void* state,
                                            int64_t size);

/// Continues where the state was taken, in any completer of the same faces, type and settings, on
/// any machine. With the same build on the same kind of processor the results are the same to the
/// byte, otherwise up to rounding. `size`: exactly that of the state. Allocates.
DYNMESH_EXPORT dynmesh_status dynmesh_restore(dynmesh_completer* completer, const void* state,
                                              int64_t size);

/// k, the number of vertices; 0 for null.
DYNMESH_EXPORT int64_t dynmesh_n_vertices(const dynmesh_completer* completer);

/// (k,) of the last frame: 0 known, g estimated and reached by iteration g, -1 unseen. Valid until
/// the next call that changes the completer, by any thread; null for null and while another thread
/// is inside.
DYNMESH_EXPORT const int32_t* dynmesh_generation(const dynmesh_completer* completer);

/// (k,) frames since the vertex was last observed. Valid as dynmesh_generation.
DYNMESH_EXPORT const int32_t* dynmesh_age(const dynmesh_completer* completer);

/// Of the last frame; all vertices known before the first.
DYNMESH_EXPORT dynmesh_status dynmesh_report(const dynmesh_completer* completer,
                                             dynmesh_frame_report* report);

// The connectivity -------------------------------------------------------------------------------

typedef struct dynmesh_topology_report {
  int64_t components;         ///< connected components; an isolated vertex is one
  int64_t isolated_vertices;  ///< vertices without an edge
  int64_t boundary_edges;     ///< edges with one face, among the faces not refused
  int64_t refused_faces;      ///< that no half-edge mesh can hold; their edges count all the same
} dynmesh_topology_report;

DYNMESH_EXPORT dynmesh_status dynmesh_topology(const dynmesh_completer* completer,
                                               dynmesh_topology_report* report);

/// Which face the refused face `number`, counted from 0, is, and what is wrong with it, for people.
/// `*reason` is valid as long as the completer lives.
DYNMESH_EXPORT dynmesh_status dynmesh_refused_face(const dynmesh_completer* completer,
                                                   int64_t number, int64_t* face,
                                                   const char** reason);

// Template files ---------------------------------------------------------------------------------

/// The complete first frame of a dynamic mesh, in the library's memory.
typedef struct dynmesh_template {
  const float* vertices;  ///< x y z, packed, in the order of the file
  int64_t n_vertices;
  const int32_t* faces;  ///< packed; polygons are fanned from their first vertex
  int64_t n_faces;
} dynmesh_template;

/// Reads OBJ, PLY or OFF, by suffix. No vertex or face is dropped, merged or renumbered; a file
/// that cannot be read so is refused. Free `*mesh` with dynmesh_free_template; it is null where
/// this fails.
DYNMESH_EXPORT dynmesh_status dynmesh_read_template(const char* path,
                                                    const dynmesh_template** mesh);

/// Null is allowed.
DYNMESH_EXPORT void dynmesh_free_template(const dynmesh_template* mesh);

#ifdef __cplusplus
}
#endif
// NOLINTEND(modernize-deprecated-headers, modernize-use-using)

#endif
