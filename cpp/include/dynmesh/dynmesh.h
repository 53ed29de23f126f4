/// The C interface of dynmesh, which can be called from any language that can call C. It wraps the
/// completer of completer.hpp and the tracker of tracker.hpp.
///
/// Status. A function that can fail returns a dynmesh_status. If it is not DYNMESH_OK, nothing has
/// changed: the completer is as it was before the call, nothing was written unless stated
/// otherwise, and dynmesh_last_message() says what is wrong, where, and with which value. This
/// includes DYNMESH_OUT_OF_MEMORY. No exception leaves a function, and nothing is printed.
///
/// Arguments. Pointers must not be null unless stated otherwise. Null pointers, negative counts and
/// bad data that the completer can detect are refused with DYNMESH_INVALID_ARGUMENT. The caller
/// must guarantee what cannot be detected: that counts and strides describe valid memory, and that
/// a handle has not been destroyed. The values of positions, indices and masks, and the bytes of a
/// mesh file or a state, may be arbitrary. The library never keeps a pointer that it was given.
///
/// Threads. A completer or tracker may be used by one thread at a time, and so may a training
/// sequence. While one thread is executing a call, calls from other threads return DYNMESH_IN_USE
/// immediately and change nothing. At any time, a thread may call dynmesh_n_vertices,
/// dynmesh_state_size and dynmesh_tracker_state_size, which return constant properties, and
/// dynmesh_report, which returns that of the last complete frame.
/// dynmesh_destroy, dynmesh_tracker_destroy and dynmesh_training_destroy may be called only if no
/// thread is using the object or will use it later. Different objects are independent.
///
/// Memory. With method motion, dynmesh_push, dynmesh_push_sparse and dynmesh_skip allocate no
/// memory if they succeed. With method detail, they do when the factor of the system of the frame
/// is larger than all earlier ones.
///
/// The structs have the memory layout of C. Before version 1.0, every minor version may change this
/// interface. Bindings that declare it in another language should check dynmesh_version().
#ifndef DYNMESH_DYNMESH_H
#define DYNMESH_DYNMESH_H

// NOLINTBEGIN(modernize-deprecated-headers, modernize-use-using): this is C as well.
#include <stdint.h>

// These two headers contain only macros, so C can include them.
#include <dynmesh/export.hpp>
#include <dynmesh/version.hpp>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  DYNMESH_OK = 0,
  DYNMESH_INVALID_ARGUMENT = 1,
  DYNMESH_OUT_OF_MEMORY = 2,    ///< memory is exhausted, or no more threads can be started
  DYNMESH_UNREADABLE_FILE = 3,  ///< returned only by dynmesh_read_template
  DYNMESH_INTERNAL_ERROR = 4,   ///< a bug in dynmesh
  DYNMESH_IN_USE = 5            ///< another thread is using this object
};
typedef int32_t dynmesh_status;

/// The message of the last call on this thread that failed, in UTF-8, or "" if none has failed. A
/// message of more than 1023 bytes is truncated between two characters. Paths appear as they
/// were given. Valid until the next call on this thread that fails.
DYNMESH_EXPORT const char* dynmesh_last_message(void);

/// The version of the library, "major.minor.patch". DYNMESH_VERSION is the version of this header.
DYNMESH_EXPORT const char* dynmesh_version(void);

// Arrays in the caller's memory ------------------------------------------------------------------

enum { DYNMESH_FLOAT32 = 32, DYNMESH_FLOAT64 = 64 };

/// Positions that are read: coordinate c of row i is element i * row_stride + c * column_stride.
/// Strides are given in elements, not bytes, and may be negative. For tightly packed x y z, they
/// are 3 and 1, or 0 and 0, since 0 means tightly packed. `data` must have the alignment of its
/// elements. It may be null if `count` is 0.
typedef struct dynmesh_points {
  const void* data;
  int64_t count;          ///< rows
  int64_t row_stride;     ///< 0: 3, for which column_stride must be 1 or 0
  int64_t column_stride;  ///< 0: 1
  int32_t type;           ///< DYNMESH_FLOAT32 or DYNMESH_FLOAT64
} dynmesh_points;

/// Positions that are written. The fields have the same meaning as those of dynmesh_points.
typedef struct dynmesh_output {
  void* data;
  int64_t count;
  int64_t row_stride;
  int64_t column_stride;
  int32_t type;
} dynmesh_output;

/// A known mask: one byte for each vertex, which is not zero if the vertex was observed. `stride`
/// is given in bytes and may be negative; for a tightly packed mask it is 1 or 0.
typedef struct dynmesh_mask {
  const uint8_t* data;
  int64_t count;
  int64_t stride;
} dynmesh_mask;

// Settings ---------------------------------------------------------------------------------------

enum { DYNMESH_METHOD_MOTION = 0, DYNMESH_METHOD_DETAIL = 1 };
enum { DYNMESH_DISCONNECTED_HOLD = 0, DYNMESH_DISCONNECTED_FOLLOW = 1 };

/// The settings of a completer: what each means and requires is said of the member of that name of
/// Settings in settings.hpp. Truth values are 0 or not. Call dynmesh_default_settings first and
/// then change fields, since the defaults are not zero and a struct of zeros is refused.
///
///     dynmesh_settings settings;
///     dynmesh_default_settings(&settings, sizeof settings);
///     settings.extra_iterations = 10;
typedef struct dynmesh_settings {
  /// sizeof(dynmesh_settings), set by dynmesh_default_settings. Later versions may append fields,
  /// and the size tells the library which fields the caller knows. Any other value is refused.
  int64_t size;
  int32_t method;            ///< DYNMESH_METHOD_DETAIL, the default, or DYNMESH_METHOD_MOTION
  int32_t revisit;           ///< whether satellites are estimated again; default: 1
  int32_t extra_iterations;  ///< default: 0
  int32_t disconnected;      ///< DYNMESH_DISCONNECTED_FOLLOW, the default, or _HOLD
  double noise;              ///< standard deviation, in the unit of positions; default: NaN, none
  int32_t reject_outliers;   ///< default: 0
  int32_t threads;           ///< 1 to 256; default: 1
  int32_t learn;             ///< whether it learns from the frames that it completes; default: 0
  int32_t uncertainty;       ///< whether dynmesh_standard_error is wanted; default: 0
} dynmesh_settings;

/// Writes the defaults to all fields. Pass sizeof(dynmesh_settings) as `size`. If this version of
/// the library does not know the size, it is refused and nothing is written.
DYNMESH_EXPORT dynmesh_status dynmesh_default_settings(dynmesh_settings* settings, int64_t size);

// The completer ----------------------------------------------------------------------------------

typedef struct dynmesh_completer dynmesh_completer;

/// Statistics of one completed frame. known + filled + disconnected is the number of vertices.
typedef struct dynmesh_frame_report {
  int64_t known;
  int64_t filled;        ///< the number of vertices estimated by the method
  int64_t disconnected;  ///< not connected to a known vertex by a chain of edges
  int64_t rejected;      ///< observed, but treated as unknown: see reject_outliers
  int64_t iterations;    ///< iterations of the method
  double seconds;        ///< wall time of the call; 0 after dynmesh_reset and dynmesh_restore
  double blend;          ///< the weight of the shape of frame 0; 0 with DYNMESH_METHOD_MOTION
  double prior_weight;   ///< how much the training frames are used, 0 to 1; 1 with `learn`
  double prior_share;    ///< the share of the residual that they explain, 0 to 1
  /// How far the estimated vertices keep their edges rather than their shape, 0 to 1; the mean.
  double first_order_share;
  /// With `uncertainty`, the root mean square standard error of the estimated vertices; else 0.
  double standard_error;
  int32_t quality;   ///< DYNMESH_GOOD, _DOUBTFUL or _RUINED; see FrameReport in frame_report.hpp
  char reason[512];  ///< why it is not good; empty if it is
} dynmesh_frame_report;

/// Creates a completer from `n_faces` packed triangles of three vertex indices each, and from frame
/// 0, which must be complete and finite. All later positions must have the type of `first_frame`.
/// If `settings` is null, the defaults are used; see dynmesh_default_settings. Free `*completer`
/// with dynmesh_destroy. It is set to null if this function fails.
DYNMESH_EXPORT dynmesh_status dynmesh_create(const int32_t* faces, int64_t n_faces,
                                             const dynmesh_points* first_frame,
                                             const dynmesh_settings* settings,
                                             dynmesh_completer** completer);

/// Null is allowed.
DYNMESH_EXPORT void dynmesh_destroy(dynmesh_completer* completer);

// Training --------------------------------------------------------------------------------------

/// Complete frames of the same mesh, for example of a range-of-motion recording or of the animation
/// of a template. From them, DYNMESH_METHOD_DETAIL learns how the shape of the subject varies.
/// Where the subject is and how it is turned does not matter, but the unit of length does. Of many
/// frames, 75 at most are kept, at regular intervals.
typedef struct dynmesh_training dynmesh_training;

/// Creates a training sequence without frames, of a mesh of `n_vertices`. `type` is DYNMESH_FLOAT32
/// or DYNMESH_FLOAT64, and must be that of the completers that are created from it. Free
/// `*training` with dynmesh_training_destroy. It is set to null if this function fails.
DYNMESH_EXPORT dynmesh_status dynmesh_training_create(int64_t n_vertices, int32_t type,
                                                      dynmesh_training** training);

/// Adds a complete frame with a row for each vertex. Frames of several training sequences can be
/// added one after another. Allocates memory.
DYNMESH_EXPORT dynmesh_status dynmesh_training_add(dynmesh_training* training,
                                                   const dynmesh_points* frame);

/// Null is allowed.
DYNMESH_EXPORT void dynmesh_training_destroy(dynmesh_training* training);

/// Creates a completer that has learned from a training sequence of three frames or more. Requires
/// DYNMESH_METHOD_DETAIL. The root mean square distance of the vertices from their centre may
/// differ from that of `first_frame` by a factor of up to 50; beyond that, the unit of length is
/// wrong. The frames are copied, so the training sequence can be destroyed afterwards. The other
/// arguments are those of dynmesh_create.
DYNMESH_EXPORT dynmesh_status dynmesh_create_trained(const int32_t* faces, int64_t n_faces,
                                                     const dynmesh_points* first_frame,
                                                     const dynmesh_settings* settings,
                                                     dynmesh_training* training,
                                                     dynmesh_completer** completer);

// Frames -----------------------------------------------------------------------------------------

/// Completes the next frame. Known vertices are returned exactly as given, and all others are
/// estimated. With the setting `noise`, known vertices move as well; vertices rejected by
/// `reject_outliers` are estimated.
///
/// `points` has one row for each vertex; rows that are not known are not read. If `known` is null,
/// rows with a coordinate that is not finite count as missing, and all others are known. A known
/// position must be finite and within 1e18 for float, 1e200 for double.
///
/// `out` has one row for each vertex. It may be the same array as `points`, or other columns of the
/// same interleaved buffer. Output that would overwrite input in any other way is refused. `report`
/// may be null.
DYNMESH_EXPORT dynmesh_status dynmesh_push(dynmesh_completer* completer,
                                           const dynmesh_points* points, const dynmesh_mask* known,
                                           const dynmesh_output* out, dynmesh_frame_report* report);

/// Completes the next frame, of which only the vertices `indices[i]` were observed, at the
/// positions in row i of `points`. Indices may be in any order but must not repeat. `indices` may
/// be null if `n_indices` is 0. The other arguments are those of dynmesh_push.
DYNMESH_EXPORT dynmesh_status dynmesh_push_sparse(dynmesh_completer* completer,
                                                  const int32_t* indices, int64_t n_indices,
                                                  const dynmesh_points* points,
                                                  const dynmesh_output* out,
                                                  dynmesh_frame_report* report);

/// Completes a frame in which no vertex was observed. The arguments are those of dynmesh_push.
DYNMESH_EXPORT dynmesh_status dynmesh_skip(dynmesh_completer* completer, const dynmesh_output* out,
                                           dynmesh_frame_report* report);

/// Makes this complete frame the new frame 0, as if the completer were newly created. Allocates
/// memory.
DYNMESH_EXPORT dynmesh_status dynmesh_reset(dynmesh_completer* completer,
                                            const dynmesh_points* frame);

/// Sets `*size` to the number of bytes that dynmesh_state writes, which does not change during the
/// lifetime of the completer. Allocates no memory.
DYNMESH_EXPORT dynmesh_status dynmesh_state_size(const dynmesh_completer* completer, int64_t* size);

/// Writes everything that later frames depend on to `state`, a buffer of `size` bytes. A buffer
/// smaller than dynmesh_state_size is refused; the rest of a larger one is left unchanged.
/// Completers that received the same frames have identical states. Allocates memory.
DYNMESH_EXPORT dynmesh_status dynmesh_state(const dynmesh_completer* completer, void* state,
                                            int64_t size);

/// Continues from a state, in any completer with the same faces, type, settings and training, on
/// any machine. With the same build on the same kind of processor the results are identical;
/// otherwise they agree up to rounding. `size` must be exactly the size of the state. Allocates
/// memory.
DYNMESH_EXPORT dynmesh_status dynmesh_restore(dynmesh_completer* completer, const void* state,
                                              int64_t size);

/// Returns the number of vertices, k, or 0 if `completer` is null.
DYNMESH_EXPORT int64_t dynmesh_n_vertices(const dynmesh_completer* completer);

/// Returns an array (k,) with the generation of each vertex in the last frame: 0 for a known
/// vertex, the number of edges to the nearest known vertex for an estimated one, -1 for a
/// disconnected one. Valid until the next call, by any thread, that changes the completer. Returns
/// null if `completer` is null or in use by another thread.
DYNMESH_EXPORT const int32_t* dynmesh_generation(const dynmesh_completer* completer);

/// Returns an array (k,) with the number of frames since each vertex was last observed. It is valid
/// for as long as that of dynmesh_generation.
DYNMESH_EXPORT const int32_t* dynmesh_age(const dynmesh_completer* completer);

/// Writes the standard error of a coordinate of each vertex in the last frame, in the unit of the
/// positions, to `values`, which has room for `count` numbers of `type`. They must be the number of
/// vertices and the type of the first frame. The true positions of about 90 % of the estimated
/// vertices are within 2.5 standard errors, and of half of them within 1.54. 0 for exact known
/// vertices, infinity for disconnected vertices. Refused without the setting `uncertainty`.
DYNMESH_EXPORT dynmesh_status dynmesh_standard_error(const dynmesh_completer* completer,
                                                     void* values, int64_t count, int32_t type);

/// Writes the report of the last frame. Before the first frame, all vertices count as known. May be
/// called at any time.
DYNMESH_EXPORT dynmesh_status dynmesh_report(const dynmesh_completer* completer,
                                             dynmesh_frame_report* report);

// Tracking in raw scans --------------------------------------------------------------------------

/// Tracks a template in scans without correspondences; see tracker.hpp. The rules of completers for
/// status, arguments and threads hold for trackers as well. Frames allocate memory for the search
/// tree of the scan, and where a scan, an image or a factor is larger than all earlier ones.
typedef struct dynmesh_tracker dynmesh_tracker;

/// How well a surface explains what was measured of it; see Agreement in tracker.hpp.
typedef struct dynmesh_agreement {
  int64_t points;      ///< how many points were compared
  double far_share;    ///< the share farther than a mean edge from the surface; NaN without points
  double disagreeing;  ///< the share near it with the normal of another surface; NaN without points
  double distance;     ///< root mean square of those that are not far; NaN without any
} dynmesh_agreement;

enum { DYNMESH_GOOD = 0, DYNMESH_DOUBTFUL = 1, DYNMESH_RUINED = 2 };

/// How a mesh lies in a scan, and how good that is; see Measure in quality.hpp.
typedef struct dynmesh_measure {
  dynmesh_agreement agreement;
  double unexplained;
  double hole;
  double overlap;
  double stretch;
  double growth;
  double explained;
  double contradicted;
  double change;
  double parted;
  double others;
  double others_distance;
  double noise;
  double doubt;
  double leap;
  double lost;
  double seen;
  int32_t quality;   ///< DYNMESH_GOOD, _DOUBTFUL or _RUINED
  char reason[512];  ///< why it is not good, in a sentence; empty if it is
} dynmesh_measure;

/// What a tracker reports of a frame. known + filled + disconnected is the number of vertices.
typedef struct dynmesh_tracking_report {
  int64_t known;         ///< the number of vertices that have a measured point
  int64_t filled;        ///< the number of other vertices of their components
  int64_t disconnected;  ///< vertices of components without a measured point
  int64_t iterations;    ///< how often points were matched
  int32_t recovered;     ///< 1 if the template was lost and found again, else 0
  dynmesh_measure measure;
  double seconds;  ///< wall time of the call; 0 after a reset or restore
} dynmesh_tracking_report;

/// A depth image of a pinhole camera. The depth of a pixel is data[row * row_stride + column *
/// column_stride], along the axis of the camera and in the unit of the template; 0, NaN or infinite
/// where nothing was measured. Strides are given in elements; if row_stride is 0, the image is
/// tightly packed.
typedef struct dynmesh_depth_image {
  const float* data;
  int64_t height;
  int64_t width;
  int64_t row_stride;
  int64_t column_stride;
  double intrinsics[9];  ///< row by row: fx, s, cx, 0, fy, cy, 0, 0, 1, in pixels
  double pose[16];  ///< row by row: from the camera, with +z ahead and y down, to the template, in
                    ///< its unit
  const uint8_t* colours;  ///< three bytes of each pixel, row by row and packed, or null
} dynmesh_depth_image;

/// Creates a tracker from a template in the pose of the first scan. `threads` is the number of
/// threads that may work on a frame, 1 to 256; more than one helps from about 2 000 vertices or
/// points on. All later positions must have the type of `first_frame`. Free `*tracker` with
/// dynmesh_tracker_destroy. It is set to null if this function fails.
DYNMESH_EXPORT dynmesh_status dynmesh_tracker_create(const int32_t* faces, int64_t n_faces,
                                                     const dynmesh_points* first_frame,
                                                     int32_t threads, dynmesh_tracker** tracker);

/// Creates a tracker as dynmesh_tracker_create does, with more choices. If `uncertainty` is not
/// zero, dynmesh_tracker_standard_error returns the standard error of each vertex. If `recover` is
/// not zero, the template is sought again where it is lost. `resolution` is 0 for the best, or the
/// number of vertices on which the template is tracked live. See TrackerSettings in tracker.hpp.
/// `training` is null, or a training sequence of three frames or more of the type of `first_frame`,
/// as for dynmesh_create_trained; its frames are copied.
DYNMESH_EXPORT dynmesh_status dynmesh_tracker_create_with(const int32_t* faces, int64_t n_faces,
                                                          const dynmesh_points* first_frame,
                                                          int32_t threads, int32_t uncertainty,
                                                          int32_t recover, int32_t resolution,
                                                          dynmesh_training* training,
                                                          dynmesh_tracker** tracker);

/// Null is allowed.
DYNMESH_EXPORT void dynmesh_tracker_destroy(dynmesh_tracker* tracker);

/// Finds the template in a scan of any number of points. All positions are in the axes and the unit
/// of the template. `normals` has a row for each point, or is null, and then they are estimated.
/// `viewpoints` has a row for each sensor, or is null. `colours` has a row for each point, or is
/// null; see Scan in tracker.hpp. `out` has a row for each vertex. `report` may be null. The first
/// scan after creation or a reset must be where the template is, or DYNMESH_INVALID_ARGUMENT is
/// returned.
DYNMESH_EXPORT dynmesh_status dynmesh_tracker_push(
    dynmesh_tracker* tracker, const dynmesh_points* points, const dynmesh_points* normals,
    const dynmesh_points* viewpoints, const dynmesh_points* colours, const dynmesh_output* out,
    dynmesh_tracking_report* report);

/// Finds the template in the depth images of one or several cameras of the same moment.
DYNMESH_EXPORT dynmesh_status dynmesh_tracker_push_depth(dynmesh_tracker* tracker,
                                                         const dynmesh_depth_image* images,
                                                         int64_t n_images,
                                                         const dynmesh_output* out,
                                                         dynmesh_tracking_report* report);

/// A frame in which nothing was measured: the template stays where it is.
DYNMESH_EXPORT dynmesh_status dynmesh_tracker_skip(dynmesh_tracker* tracker,
                                                   const dynmesh_output* out,
                                                   dynmesh_tracking_report* report);

/// Makes this complete frame the new template, as if the tracker were newly created.
DYNMESH_EXPORT dynmesh_status dynmesh_tracker_reset(dynmesh_tracker* tracker,
                                                    const dynmesh_points* frame);

/// As dynmesh_state_size, dynmesh_state and dynmesh_restore.
DYNMESH_EXPORT dynmesh_status dynmesh_tracker_state_size(const dynmesh_tracker* tracker,
                                                         int64_t* size);
DYNMESH_EXPORT dynmesh_status dynmesh_tracker_state(const dynmesh_tracker* tracker, void* state,
                                                    int64_t size);
DYNMESH_EXPORT dynmesh_status dynmesh_tracker_restore(dynmesh_tracker* tracker, const void* state,
                                                      int64_t size);

/// Returns an array (k,): 1 for vertices that have a measured point in the last frame, else 0.
/// Valid until the next call that changes the tracker, as are the next two. Null if `tracker` is
/// null or in use by another thread.
DYNMESH_EXPORT const uint8_t* dynmesh_tracker_observed(const dynmesh_tracker* tracker);
/// Returns an array (k,): 0 for observed vertices, the number of edges to the nearest observed
/// vertex for others, -1 where there is none.
DYNMESH_EXPORT const int32_t* dynmesh_tracker_generation(const dynmesh_tracker* tracker);
/// Returns an array (k,): the number of frames since each vertex was last observed.
DYNMESH_EXPORT const int32_t* dynmesh_tracker_age(const dynmesh_tracker* tracker);

/// Writes the standard error of the distance of each vertex from the true surface to `values`, in
/// the unit of the positions, as dynmesh_standard_error does: about 90 % of the vertices are
/// within 1.645 of it, fewer of cloth that is not seen. How far they are off along the surface is
/// not known. Refused without `uncertainty`.
DYNMESH_EXPORT dynmesh_status dynmesh_tracker_standard_error(const dynmesh_tracker* tracker,
                                                             void* values, int64_t count,
                                                             int32_t type);

// Registration -----------------------------------------------------------------------------------

/// What is registered, with what and how; see registration.hpp. What is not given is null or 0.
typedef struct dynmesh_registration_request {
  const int32_t* faces;
  int64_t n_faces;
  const dynmesh_points* positions;  ///< the template; all other positions have its type
  const dynmesh_points* points;     ///< the scan, as for dynmesh_tracker_push, or null
  const dynmesh_points* normals;
  const dynmesh_points* viewpoints;
  const dynmesh_depth_image* images;  ///< used if `points` is null
  int64_t n_images;
  const int32_t* landmark_vertices;  ///< as many as `landmarks` has rows
  const dynmesh_points* landmarks;
  dynmesh_training* training;
  int32_t align;    ///< whether a rigid motion is sought, 0 or 1
  int32_t scale;    ///< whether the template may be in another unit, 0 or 1
  int32_t threads;  ///< 1 to 256; more than one helps from about 2 000 vertices or points on
} dynmesh_registration_request;

/// What was found, beside the vertices; see Registration in registration.hpp.
typedef struct dynmesh_registration_report {
  double transform[16];  ///< row by row
  double scale;
  dynmesh_measure measure;
  int64_t rounds;
  int32_t converged;  ///< 0 or 1
} dynmesh_registration_report;

/// Registers a template with a scan. `vertices` has a row for each vertex and the type of the
/// template. `observed` and `standard_error` have room for a value of each vertex, and may be null;
/// standard errors take additional time.
DYNMESH_EXPORT dynmesh_status dynmesh_register(const dynmesh_registration_request* request,
                                               const dynmesh_output* vertices, uint8_t* observed,
                                               double* standard_error,
                                               dynmesh_registration_report* report);

// Template files ---------------------------------------------------------------------------------

/// The complete first frame of a dynamic mesh. The library owns the memory.
typedef struct dynmesh_template {
  const float* vertices;  ///< x y z, packed, in the order of the file
  int64_t n_vertices;
  const int32_t*
      faces;  ///< packed; polygons are split into a fan of triangles from their first vertex
  int64_t n_faces;
} dynmesh_template;

/// Reads an OBJ or PLY file, according to its suffix. `path` is UTF-8, on Windows as well. No
/// vertex or face is dropped, merged or renumbered; a file for which this is not possible is
/// refused. Free `*mesh` with dynmesh_free_template. It is set to null if this function fails.
DYNMESH_EXPORT dynmesh_status dynmesh_read_template(const char* path,
                                                    const dynmesh_template** mesh);

/// Null is allowed.
DYNMESH_EXPORT void dynmesh_free_template(const dynmesh_template* mesh);

#ifdef __cplusplus
}
#endif
// NOLINTEND(modernize-deprecated-headers, modernize-use-using)

#endif
