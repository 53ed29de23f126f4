/// The docstrings of dynmesh.Completer and dynmesh.FrameReport.
#pragma once

namespace dynmesh {

constexpr const char* completer_doc =
    R"doc(Completes a dynamic mesh, one frame at a time.

    completer = dynmesh.Completer(faces, first_frame)
    for points, known in sensor:
        frame = completer.push(points, known)

Each frame is completed from the frame itself and earlier frames only. `push`, `push_sparse` and
`skip` return the completed frame, an array (k, 3) with the dtype of `first_frame`. Known vertices
are returned exactly as given, and all others are estimated. With `noise`, known vertices move as
well; vertices rejected by `reject_outliers` are estimated. These methods release the GIL. Bad input
raises ValueError, or TypeError for a wrong type, with a message that says what is wrong, where, and
with which value. The completer is then unchanged.

A completer may be used by one thread at a time. A call while another thread is using it raises
RuntimeError. It can be pickled and copied, also into another process, and continues there with the
same results. For that, it keeps the faces, the first frame and the training frames as they were
given: 12 bytes for each triangle, and 3 numbers for each vertex and frame.

Args:
    faces: The triangles, (m, 3) integers, or other polygons: (m, 4) quads, a list of lists of
        vertices, or Polygons. Each is cut into triangles around its first corner, as those of files
        are. Triangles that a half-edge mesh cannot represent are listed in `topology`; their edges
        are still used.
    first_frame: Frame 0, (k, 3) float32 or float64, complete and finite. Later positions are
        converted to its dtype. When float64 is converted to float32, a finite number out of range
        becomes the largest float32 of its sign; a known position with such a coordinate is refused
        as too large and does not count as missing.)doc";

/// After the settings.
constexpr const char* training_doc =
    R"doc(    training: Complete frames of the same mesh, of this subject or one like it: an array (n, k, 3)
        or any iterable of at least three frames, of which at most 75 are kept. From them, "detail"
        learns how the shape of the subject varies, which usually makes it more accurate.
        Training frames that do not describe the subject have no effect: `report.prior_weight` is
        then 0. Requires "detail".)doc";

constexpr const char* standard_error_doc =
    R"doc((k,), in the completer's dtype and the unit of the positions: the standard error of a
coordinate of each vertex of the last frame. The true positions of about 90 % of the estimated
vertices are within 2.5 standard errors, and of half of them within 1.54. 0 for known vertices and
before the first frame, infinity for disconnected vertices; with `noise`, it is not 0 for known
vertices. ValueError without `uncertainty`. See docs/method.md, "Error bars".)doc";

constexpr const char* push_doc = R"doc(push(self, points, known=None, *, out=None)
--

Complete the next frame.

Args:
    points: Positions, (k, 3) float32 or float64 with any strides. Rows that are not known are
        ignored.
    known: The known mask, (k,) bool: True for vertices that were observed. If None, rows of
        `points` that are not finite are missing, and all others are known.
    out: An array (k, 3) of the completer's dtype to which the completed frame is written. It may be
        `points` itself, but must not overlap the input in any other way. If None, a new array is
        allocated.

Returns:
    The completed frame, (k, 3): `out`, or the new array.)doc";

constexpr const char* push_sparse_doc = R"doc(push_sparse(self, indices, points, *, out=None)
--

Complete the next frame from the observed vertices only.

Args:
    indices: The observed vertices, (n,) integers, in any order and without duplicates.
    points: Their positions, (n, 3).
    out: See `push`.

Returns:
    The completed frame, (k, 3).)doc";

constexpr const char* skip_doc = R"doc(skip(self, *, out=None)
--

Complete a frame in which no vertex was observed.

Args:
    out: See `push`.

Returns:
    The completed frame, (k, 3).)doc";

constexpr const char* reset_doc = R"doc(reset(self, frame)
--

Start again with a new frame 0.

Args:
    frame: The new frame 0, (k, 3), complete and finite.)doc";

constexpr const char* state_doc = R"doc(state(self)
--

Return everything that later frames depend on, to be stored or sent.

Returns:
    Little-endian bytes for `restore`. They contain no times, so completers that received the same
        frames have identical states.)doc";

constexpr const char* restore_doc = R"doc(restore(self, state)
--

Continue from a state, with the same results, or up to rounding on another kind of processor.

The seconds of `report` become 0.

Args:
    state: The bytes that `state` returned, from a completer with the same faces, dtype,
        settings and training frames, on any machine.)doc";

constexpr const char* frame_report_doc = R"doc(Statistics of one frame.

Attributes:
    known: The number of vertices that were observed.
    filled: The number of vertices that the method estimated.
    disconnected: The number of vertices that no chain of edges connects to a known one. known +
        filled + disconnected = k.
    iterations: The number of iterations of the method.
    rejected: The number of vertices that were observed but rejected as outliers.
    seconds: The wall time of the completion.
    blend: b of method "detail", the weight of the shape of frame 0; 0 for "motion".
    prior_weight: With `training`, how much the training frames are used, from 0 to 1. With
        `learn`, 1 as soon as something is learned. Else 0.
    prior_share: With either, the share of the residual that they explain, from 0 to 1; see
        docs/method.md, "Training frames". Else 0.
    first_order_share: How far the estimated vertices keep the lengths of their edges, as cloth
        does, rather than their shape: the mean, from 0 to 1; see docs/method.md, "Edges". Else 0.
    standard_error: With `uncertainty`, the root mean square of the standard errors of the
        estimated vertices, in the unit of the positions; else 0.
    factor_seconds, rotation_seconds, solve_seconds: The times of the stages of "detail"; 0 for
        "motion".)doc";

}  // namespace dynmesh
