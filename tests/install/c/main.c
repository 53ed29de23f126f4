// Completes a translation, in both precisions.
#include <dynmesh/dynmesh.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const int32_t faces[] = {0, 1, 2, 2, 1, 3};

static int is_near(double x, double expected) { return x > expected - 1e-5 && x < expected + 1e-5; }

static int completes_a_translation(void* frame, int32_t type) {
  const dynmesh_points points = {frame, 4, 3, 1, type};
  const dynmesh_output out = {frame, 4, 3, 1, type};
  dynmesh_completer* completer = NULL;
  dynmesh_settings settings;
  if (dynmesh_default_settings(&settings, sizeof settings) != DYNMESH_OK) return 0;
  if (dynmesh_create(faces, 2, &points, &settings, &completer) != DYNMESH_OK) return 0;
  for (int i = 0; i < 12; ++i) {
    const double x = i < 3 ? 5 : NAN;
    if (type == DYNMESH_FLOAT32) {
      ((float*)frame)[i] = (float)x;
    } else {
      ((double*)frame)[i] = x;
    }
  }
  dynmesh_frame_report report = {0};
  const int good = dynmesh_push(completer, &points, NULL, &out, &report) == DYNMESH_OK &&
                   dynmesh_skip(NULL, &out, NULL) == DYNMESH_INVALID_ARGUMENT &&
                   strcmp(dynmesh_last_message(), "completer: is a null pointer") == 0;
  dynmesh_destroy(completer);
  return good && report.known == 1 && report.filled == 3;
}

int main(void) {
  float single[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  double twice[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  const int good = completes_a_translation(single, DYNMESH_FLOAT32) &&
                   completes_a_translation(twice, DYNMESH_FLOAT64) && is_near(single[9], 6) &&
                   is_near(single[11], 5) && is_near(twice[10], 6) &&
                   strcmp(dynmesh_version(), DYNMESH_VERSION) == 0;
  printf("dynmesh %s from C: %s\n", dynmesh_version(), good ? "works" : "FAILS");
  return good ? 0 : 1;
}
