#include <dynmesh/dynmesh.h>
#include <stdio.h>

enum { N = 20, WIDTH = 160, HEIGHT = 120 };

static int failed(dynmesh_status status) {
  if (status != DYNMESH_OK) fprintf(stderr, "%s\n", dynmesh_last_message());
  return status != DYNMESH_OK;
}

int main(void) {
  static float body[N * N][3], depth[HEIGHT * WIDTH];
  static int32_t faces[2 * (N - 1) * (N - 1)][3];
  int64_t n_faces = 0;
  for (int32_t v = 0; v < N * N; ++v) { /* the template: a sheet, 2 m in front of the camera */
    body[v][0] = 0.05f * (float)(v % N) - 0.475f;
    body[v][1] = 0.05f * (float)(v / N) - 0.475f;
    body[v][2] = 2;
    if (v % N == N - 1 || v / N == N - 1) continue;
    const int32_t corners[] = {v, v + N, v + 1, v + 1, v + N, v + N + 1};
    for (int i = 0; i < 6; ++i) faces[n_faces + i / 3][i % 3] = corners[i];
    n_faces += 2;
  }
  const dynmesh_points first_frame = {body, N * N, 3, 1, DYNMESH_FLOAT32};
  const dynmesh_output tracked = {body, N * N, 3, 1, DYNMESH_FLOAT32};
  dynmesh_tracker* tracker = NULL;
  if (failed(dynmesh_tracker_create(faces[0], n_faces, &first_frame, 1, &tracker))) return 1;

  for (int i = 0; i < HEIGHT * WIDTH; ++i) depth[i] = 2.1f; /* it has moved 0.1 m away */
  const dynmesh_depth_image image = {.data = depth,
                                     .height = HEIGHT,
                                     .width = WIDTH,
                                     .row_stride = WIDTH,
                                     .column_stride = 1,
                                     .intrinsics = {150, 0, 79.5, 0, 150, 59.5, 0, 0, 1},
                                     .pose = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
  dynmesh_tracking_report report;
  const int code = failed(dynmesh_tracker_push_depth(tracker, &image, 1, &tracked, &report));
  if (!code) printf("%d vertices seen; vertex 0 is %.3f m away\n", (int)report.known, body[0][2]);
  dynmesh_tracker_destroy(tracker);
  return code;
}
