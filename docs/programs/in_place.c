#include <dynmesh/dynmesh.h>
#include <stdio.h>

typedef struct {
  float position[3];
  float normal[3];
  uint8_t seen[4];
} Vertex;

int main(void) {
  const int32_t faces[] = {0, 1, 2, 2, 1, 3};
  Vertex buffer[] = {{.position = {0, 0, 0}},
                     {.position = {1, 0, 0}},
                     {.position = {0, 1, 0}},
                     {.position = {1, 1, 0}}};
  const int64_t stride = sizeof(Vertex) / sizeof(float);
  const dynmesh_points points = {buffer[0].position, 4, stride, 1, DYNMESH_FLOAT32};
  const dynmesh_output out = {buffer[0].position, 4, stride, 1, DYNMESH_FLOAT32};
  const dynmesh_mask known = {buffer[0].seen, 4, sizeof(Vertex)};

  dynmesh_settings settings;
  dynmesh_default_settings(&settings, sizeof settings);
  settings.method = DYNMESH_METHOD_MOTION;  // the fastest
  settings.extra_iterations = 10;
  dynmesh_completer* completer = NULL;
  if (dynmesh_create(faces, 2, &points, &settings, &completer) != DYNMESH_OK) {
    fprintf(stderr, "%s\n", dynmesh_last_message());
    return 1;
  }
  buffer[3].position[2] = 5;
  buffer[3].seen[0] = 1;
  dynmesh_frame_report report;
  if (dynmesh_push(completer, &points, &known, &out, &report) == DYNMESH_OK) {
    printf("%d filled in; vertex 0 is at height %g\n", (int)report.filled, buffer[0].position[2]);
  }
  dynmesh_destroy(completer);
  return 0;
}
