/// A C program, compiled as strict C11, since a C++ compiler accepts other constructs.
#include <dynmesh/dynmesh.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

// The layout that other languages declare.
_Static_assert(sizeof(dynmesh_points) == 40 && offsetof(dynmesh_points, type) == 32, "");
_Static_assert(sizeof(dynmesh_output) == 40 && offsetof(dynmesh_output, type) == 32, "");
_Static_assert(sizeof(dynmesh_mask) == 24, "");
_Static_assert(sizeof(dynmesh_settings) == 48 && offsetof(dynmesh_settings, noise) == 24, "");
_Static_assert(sizeof(dynmesh_frame_report) == 88, "");
_Static_assert(sizeof(dynmesh_topology_report) == 32, "");
_Static_assert(sizeof(dynmesh_template) == 32, "");
_Static_assert(sizeof(dynmesh_tracking_report) == 80, "");
_Static_assert(sizeof(dynmesh_agreement) == 32, "");
_Static_assert(sizeof(dynmesh_depth_image) == 240, "");

#define EXPECT(condition) \
  if (!(condition)) return __LINE__

int run_c_program(void);

int run_c_program(void) {
  const int32_t faces[] = {0, 1, 2, 2, 1, 3};
  float frame[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  const dynmesh_points points = {frame, 4, 3, 1, DYNMESH_FLOAT32};
  const dynmesh_output out = {frame, 4, 3, 1, DYNMESH_FLOAT32};
  dynmesh_settings settings;
  EXPECT(dynmesh_default_settings(&settings, sizeof settings) == DYNMESH_OK);
  EXPECT(settings.revisit == 1 && settings.disconnected == DYNMESH_DISCONNECTED_FOLLOW &&
         settings.noise != settings.noise /* NaN */);
  dynmesh_completer* completer = NULL;
  EXPECT(dynmesh_create(faces, 2, &points, &settings, &completer) == DYNMESH_OK);

  frame[0] = NAN;
  for (int v = 1; v < 4; ++v) frame[3 * v + 2] += 5;
  dynmesh_frame_report report;
  EXPECT(dynmesh_push(completer, &points, NULL, &out, &report) == DYNMESH_OK);
  EXPECT(report.known == 3 && report.filled == 1 && frame[0] == 0 && frame[2] == 5);
  EXPECT(dynmesh_generation(completer)[0] == 1 && dynmesh_age(completer)[0] == 1);

  int64_t size = 0;
  EXPECT(dynmesh_state_size(completer, &size) == DYNMESH_OK);
  void* state = malloc((size_t)size);
  EXPECT(state != NULL && dynmesh_state(completer, state, size) == DYNMESH_OK);
  EXPECT(dynmesh_restore(completer, state, size) == DYNMESH_OK);
  free(state);
  dynmesh_destroy(completer);
  return 0;
}
