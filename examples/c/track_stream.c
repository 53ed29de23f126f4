/// Depth cameras in C: tracks a mesh in depth frames on their way from cameras to a display.
///
///     cameras | track_stream body.obj cameras.txt > tracked.raw
///
/// cameras.txt contains 28 numbers for each camera: the width and the height of its images, the
/// depth of one count, 9 intrinsics, and the 16 numbers of its pose, as dynmesh_depth_image has
/// them. A frame consists of the image of each camera, in their order: little-endian 16-bit counts,
/// row by row from the top, 0 where nothing was measured. The template is in about the pose of the
/// first frame, and in the axes and the unit of the cameras. For each frame, little-endian float32
/// x y z of every vertex are written. If a frame is refused, the mesh stays where it is, and the
/// stream continues. The time of the slowest frame is printed to standard error.
#include <dynmesh/dynmesh.h>
#include <stdio.h>
#include <stdlib.h>
#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#endif

enum { MOST_CAMERAS = 8, MOST_PIXELS = 1 << 24 };

typedef struct {
  int64_t count;
  dynmesh_depth_image images[MOST_CAMERAS];
  float* depth[MOST_CAMERAS];  ///< the memory of the images
  double scale[MOST_CAMERAS];  ///< the depth of one count
} Rig;

static int fail(const char* what) {
  fprintf(stderr, "track_stream: %s\n", what);
  return 1;
}

static int read_numbers(FILE* file, double* numbers, int n) {
  for (int i = 0; i < n; ++i) {
    if (fscanf(file, "%lf", &numbers[i]) != 1) return 0;
  }
  return 1;
}

/// Reads the cameras and allocates their images. Returns 0 if the file is bad or memory exhausted.
static int read_rig(FILE* file, Rig* rig) {
  double size[3];  // width, height, and the depth of one count
  while (rig->count < MOST_CAMERAS && read_numbers(file, size, 3)) {
    dynmesh_depth_image* image = &rig->images[rig->count];
    if (!(size[0] >= 1 && size[1] >= 1 && size[0] * size[1] <= MOST_PIXELS)) return 0;
    image->width = (int64_t)size[0];
    image->height = (int64_t)size[1];  // a row_stride of 0 means tightly packed
    if (!read_numbers(file, image->intrinsics, 9) || !read_numbers(file, image->pose, 16)) return 0;
    float* depth = malloc(sizeof(float) * (size_t)(image->width * image->height));
    if (depth == NULL) return 0;
    rig->scale[rig->count] = size[2];
    rig->depth[rig->count++] = depth;
    image->data = depth;
  }
  return rig->count > 0 && feof(file);
}

/// Reads the image of each camera. Returns 1 for a frame, 0 at the end and -1 within a frame.
static int read_frame(Rig* rig) {
  for (int64_t c = 0; c < rig->count; ++c) {
    const int64_t pixels = rig->images[c].width * rig->images[c].height;
    for (int64_t i = 0; i < pixels; ++i) {
      uint8_t bytes[2];
      const size_t got = fread(bytes, 1, 2, stdin);
      if (got != 2) return c == 0 && i == 0 && got == 0 ? 0 : -1;
      rig->depth[c][i] = (float)(rig->scale[c] * (bytes[0] + 256 * bytes[1]));
    }
  }
  return 1;
}

/// Tracks frames from standard input to standard output. `mesh` has room for all vertices, `k`.
static int run(dynmesh_tracker* tracker, Rig* rig, float* mesh, int64_t k) {
  const dynmesh_output out = {mesh, k, 3, 1, DYNMESH_FLOAT32};
  const size_t size = 3 * sizeof(float) * (size_t)k;
  long tracked = 0;
  double slowest = 0;
  int got = 0;
  while ((got = read_frame(rig)) == 1) {
    dynmesh_tracking_report report;
    if (dynmesh_tracker_push_depth(tracker, rig->images, rig->count, &out, &report) != DYNMESH_OK) {
      fprintf(stderr, "frame %ld: %s\n", tracked, dynmesh_last_message());
      if (dynmesh_tracker_skip(tracker, &out, &report) != DYNMESH_OK) {
        return fail(dynmesh_last_message());
      }
    }
    if (fwrite(mesh, 1, size, stdout) != size || fflush(stdout) != 0) {
      return fail("standard output cannot be written");
    }
    if (report.seconds > slowest) slowest = report.seconds;
    ++tracked;
  }
  fprintf(stderr, "%ld frames tracked; %.1f ms at most\n", tracked, 1e3 * slowest);
  return got == 0 ? 0 : fail("standard input ends within a frame");
}

/// Tracks the template of a file. Frees what it allocates, but not `rig`.
static int track(const char* path, Rig* rig) {
  const dynmesh_template* body = NULL;
  if (dynmesh_read_template(path, &body) != DYNMESH_OK) return fail(dynmesh_last_message());
  const dynmesh_points first_frame = {body->vertices, body->n_vertices, 3, 1, DYNMESH_FLOAT32};
  dynmesh_tracker* tracker = NULL;
  const dynmesh_status status =
      dynmesh_tracker_create(body->faces, body->n_faces, &first_frame, 1, &tracker);
  float* mesh = malloc(3 * sizeof(float) * (size_t)body->n_vertices);
  int code = 1;
  if (status != DYNMESH_OK) {
    fail(dynmesh_last_message());
  } else if (mesh == NULL) {
    fail("out of memory");
  } else {
    code = run(tracker, rig, mesh, body->n_vertices);
  }
  free(mesh);
  dynmesh_tracker_destroy(tracker);
  dynmesh_free_template(body);
  return code;
}

int main(int argc, char** argv) {
  if (argc != 3) {
    fputs("Usage: track_stream TEMPLATE CAMERAS.txt < DEPTH.raw > TRACKED.raw\n", stderr);
    return 2;
  }
#ifdef _WIN32  // which would change line ends in the frames
  _setmode(_fileno(stdin), _O_BINARY);
  _setmode(_fileno(stdout), _O_BINARY);
#endif
  FILE* file = fopen(argv[2], "r");
  if (file == NULL) return fail("the file of the cameras cannot be opened");
  static Rig rig;
  const int is_read = read_rig(file, &rig);
  fclose(file);
  const int code = is_read ? track(argv[1], &rig)
                           : fail(
                                 "the file of the cameras must contain 28 numbers for each of 1 to "
                                 "8 cameras");
  for (int64_t c = 0; c < rig.count; ++c) free(rig.depth[c]);
  return code;
}
