// Prints what a tagwrench wrench sensor feels, in newtons and newton metres.
//
//   cc read_wrench.c $(pkg-config --cflags --libs tagwrench-hid) -o read_wrench
//   ./read_wrench [SERIAL] [SAMPLES]
//
// SERIAL "-" is the first sensor; without SAMPLES it goes on until the sensor is gone or Ctrl-C.
// Columns: sequence, status, Fx Fy Fz in N, Mx My Mz in N m, age of the sample in ms.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tagwrench_hid.h>

static void print(const tagwrench_sample* sample) {
  const double age_ms = (double)(tagwrench_now_ns() - sample->capture_time_ns) / 1e6;
  printf("%u %s", (unsigned)sample->sequence, tagwrench_status_name(sample->status));
  for (int i = 0; i < 3; ++i) printf(" %.6f", sample->force_n[i]);
  for (int i = 0; i < 3; ++i) printf(" %.6f", sample->torque_nm[i]);
  printf(" %.1f\n", age_ms);
  fflush(stdout);
}

int main(int argc, char** argv) {
  const char* serial = argc > 1 && strcmp(argv[1], "-") != 0 ? argv[1] : NULL;
  long left = argc > 2 ? strtol(argv[2], NULL, 10) : -1;

  char why[TAGWRENCH_TEXT_SIZE];
  tagwrench_device* device = tagwrench_open(serial, why, sizeof why);
  if (device == NULL) {
    fprintf(stderr, "%s\n", why);
    return 2;
  }
  int got = 0;
  while (left != 0) {
    tagwrench_sample sample;
    got = tagwrench_read(device, &sample, 1000);
    if (got < 0) break;
    if (got == 0) continue;
    print(&sample);
    if (left > 0) --left;
  }
  if (got < 0) fprintf(stderr, "%s: %s\n", tagwrench_info(device)->path, tagwrench_error_text(got));
  tagwrench_close(device);
  return got < 0 ? 1 : 0;
}
