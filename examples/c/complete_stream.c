/// A capture loop in C: completes frames on their way from a sensor to a display.
///
///     sensor | complete_stream body.obj > completed.raw
///
/// Frames are little-endian float32 x y z for each vertex of the template, in the same order, with
/// NaN for vertices that were not observed. If a frame is refused, it is replaced by one predicted
/// from earlier frames, and the stream continues. The time of the slowest frame is printed to
/// standard error.
#include <dynmesh/dynmesh.h>
#include <stdio.h>
#include <stdlib.h>
#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#endif

static int fail(const char* what) {
  fprintf(stderr, "complete_stream: %s\n", what);
  return 1;
}

/// Completes frames from standard input to standard output. `frame` has room for one frame.
static int run(dynmesh_completer* completer, float* frame) {
  const int64_t k = dynmesh_n_vertices(completer);
  const dynmesh_points points = {frame, k, 3, 1, DYNMESH_FLOAT32};
  const dynmesh_output out = {frame, k, 3, 1, DYNMESH_FLOAT32};  // in place
  const size_t size = 3 * sizeof(float) * (size_t)k;
  long completed = 0;
  double slowest = 0;
  size_t got = 0;
  while ((got = fread(frame, 1, size, stdin)) == size) {
    dynmesh_frame_report report;
    if (dynmesh_push(completer, &points, NULL, &out, &report) != DYNMESH_OK) {
      fprintf(stderr, "frame %ld: %s\n", completed + 1, dynmesh_last_message());
      if (dynmesh_skip(completer, &out, &report) != DYNMESH_OK) return fail(dynmesh_last_message());
    }
    if (fwrite(frame, 1, size, stdout) != size || fflush(stdout) != 0) {
      return fail("standard output cannot be written");
    }
    if (report.seconds > slowest) slowest = report.seconds;
    ++completed;
  }
  fprintf(stderr, "%ld frames completed; %.3f ms at most\n", completed, 1e3 * slowest);
  return got == 0 ? 0 : fail("standard input ends within a frame");
}

int main(int argc, char** argv) {
  if (argc != 2) {
    fputs("Usage: complete_stream TEMPLATE < PARTIAL.raw > COMPLETED.raw\n", stderr);
    return 2;
  }
#ifdef _WIN32  // which would change line ends in the frames
  _setmode(_fileno(stdin), _O_BINARY);
  _setmode(_fileno(stdout), _O_BINARY);
#endif
  const dynmesh_template* mesh = NULL;
  if (dynmesh_read_template(argv[1], &mesh) != DYNMESH_OK) return fail(dynmesh_last_message());

  const dynmesh_points first_frame = {mesh->vertices, mesh->n_vertices, 3, 1, DYNMESH_FLOAT32};
  dynmesh_completer* completer = NULL;
  const dynmesh_status status =
      dynmesh_create(mesh->faces, mesh->n_faces, &first_frame, NULL, &completer);
  float* frame = malloc(3 * sizeof(float) * (size_t)mesh->n_vertices);
  int code = 1;
  if (status != DYNMESH_OK) {
    fail(dynmesh_last_message());
  } else if (frame == NULL) {
    fail("out of memory");
  } else {
    code = run(completer, frame);
  }
  free(frame);
  dynmesh_destroy(completer);
  dynmesh_free_template(mesh);
  return code;
}
