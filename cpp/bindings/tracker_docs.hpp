/// The docstrings of dynmesh.Tracker and dynmesh.TrackingReport.
#pragma once

namespace dynmesh {

constexpr const char* tracker_doc =
    R"doc(Tracks a template in raw scans: loose points, or depth images.

    tracker = dynmesh.Tracker(faces, first_frame)
    for points, normals in scanner:
        frame = tracker.push(points, normals, viewpoints=cameras)

No correspondences are needed. Each frame is found from what was measured in it and from earlier
frames; the method is described in docs/reference/tracking.md. `push`, `push_depth` and `skip`
return the tracked frame, an array (k, 3) with the dtype of `first_frame`, and release the GIL. Bad
input raises ValueError, or TypeError for a wrong type, with a message that says what is wrong,
where, and with which value. The tracker is then unchanged.

The first scan must be where the template is; find_alignment and register put it there. Scans that
are far away, or empty, count as frames in which nothing was observed: the template stays where it
is.

A tracker may be used by one thread at a time. A call while another thread is using it raises
RuntimeError. It can be pickled and copied; see Completer.

Args:
    faces: The triangles, (m, 3) integers, or other polygons; see Completer.
    first_frame: The template, (k, 3) float32 or float64, complete and finite, in the pose of the
        first scan.)doc";

/// After the settings.
constexpr const char* tracker_training_doc =
    R"doc(    training: None, or complete frames of the same mesh, as Completer takes them, from which the
        tracker learns how the shape of the subject varies. Training frames that do not describe the
        subject have no effect: `report.prior_weight` is then 0.)doc";

constexpr const char* tracker_push_doc =
    R"doc(push(self, points, normals=None, *, viewpoints=None, out=None)
--

Find the template in a scan.

Args:
    points: The scan, (n, 3) float32 or float64, finite, in any order and of any number, in the axes
        and the unit of the template.
    normals: The outward normals of the points, (n, 3), of any length. A normal of 0 is not known,
        and its point is not used. If None, normals are estimated from the 12 nearest points, which
        takes longer than everything else, and turned to the viewpoints; without viewpoints they
        match either side of the surface.
    viewpoints: The positions of the sensors, (c, 3). With them, vertices that no sensor can see are
        not compared with the scan, and sheets, such as cloth or a mask, are also compared where
        they are seen from behind. Give them if they are known. In the axes and the unit of the
        template.
    out: An array (k, 3) of the tracker's dtype to which the tracked frame is written. If None, a
        new array is allocated.

Returns:
    The tracked frame, (k, 3): `out`, or the new array.)doc";

constexpr const char* tracker_push_depth_doc =
    R"doc(push_depth(self, depth, intrinsics, pose, *, out=None)
--

Find the template in depth images.

Several cameras of the same moment are given as lists of the same length.

Args:
    depth: (h, w) float32 or float64: depths along the axis of the camera, in the unit of the
        template. Where nothing was measured, they are 0, NaN or infinite.
    intrinsics: (3, 3) in pixels: fx, s, cx; 0, fy, cy; 0, 0, 1. The centre of the first pixel is at
        0, 0.
    pose: (4, 4): the rigid motion from the axes of the camera to those of the template, in its
        unit. The camera looks along its +z axis, with x to the right and y down, as in OpenCV.
    out: See `push`.

Returns:
    The tracked frame, (k, 3).)doc";

constexpr const char* tracker_skip_doc = R"doc(skip(self, *, out=None)
--

Pass over a frame in which nothing was measured: the template stays where it is.

Args:
    out: See `push`.

Returns:
    The tracked frame, (k, 3).)doc";

constexpr const char* tracker_reset_doc = R"doc(reset(self, frame)
--

Start again with a new template.

Args:
    frame: The new template, (k, 3), complete and finite.)doc";

constexpr const char* tracker_state_doc = R"doc(state(self)
--

Return everything that later frames depend on, to be stored or sent.

Returns:
    Little-endian bytes for `restore`. They contain no times, so trackers that received the same
        frames have identical states.)doc";

constexpr const char* tracker_restore_doc = R"doc(restore(self, state)
--

Continue from a state, with the same results, or up to rounding on another kind of processor.

The seconds of `report` become 0.

Args:
    state: The bytes that `state` returned, from a tracker with the same faces, dtype and
        training frames, on any machine.)doc";

constexpr const char* tracker_standard_error_doc =
    R"doc((k,), with `uncertainty=True`: the standard error of each vertex.

The standard error of the distance of each vertex of the last frame from the surface, along its
normal, in the unit of the positions: about 90 % of the vertices are within 1.645 of it. The
distance along the surface, which may be several times as large, is not included. It is infinite
where no measured point is connected, and 0 before the first frame. Without uncertainty, ValueError
is raised.)doc";

constexpr const char* tracker_agreement_of_sensors_doc =
    R"doc(list of Agreement: how well the last frame explains what each sensor measured.

One for each image or viewpoint, in the order of the call. A point of a scan counts for the
viewpoint that its normal turns to most. Empty before the first frame and after `restore`.)doc";

constexpr const char* agreement_doc =
    R"doc(How well a surface explains what a sensor measured of it.

Attributes:
    points: As in TrackingReport, like all others.
    far: The share of the points that are far from the surface.
    disagreeing: The share with the normal of another surface.
    distance: The root mean square distance of those that are not far.)doc";

constexpr const char* tracking_report_doc = R"doc(Statistics of one tracked frame.

`known` counts the observed vertices, `filled` the others of their components, `disconnected`
those of components without any, and `iterations` how often correspondences were found. With
training, `prior_weight` and `prior_share` are as in FrameReport, and with uncertainty,
`standard_error` is the root mean square of those
of all vertices where it is finite. See also FrameReport.

Attributes:
    points: How many measured points were compared with the surface: all of a small scan, every so
        manyth one of a large one. Stray points, which are far from the surface and sparser than
        others, are left out.
    far: The share of them that are farther than one mean edge of the template from the surface, 0
        to 1; NaN without points. It tells best how well a frame was tracked; up to 0.01 is usual.
    disagreeing: The share that is near the surface, but whose normal is that of another one.
    distance: The root mean square distance from the surface of those that are not far, in the unit
        of the positions; NaN without any.
    recovered: Whether the template was lost and found again by a registration.)doc";

}  // namespace dynmesh
