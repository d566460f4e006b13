// Force and torque in newtons from a tagwrench wrench sensor, over hidapi.
//
//   char why[TAGWRENCH_TEXT_SIZE];
//   tagwrench_device* device = tagwrench_open(NULL, why, sizeof why);
//   if (device == NULL) { fprintf(stderr, "%s\n", why); return 1; }
//   tagwrench_sample sample;
//   while (tagwrench_read(device, &sample, -1) > 0) {
//     if (sample.has_numbers) printf("%g %g %g N\n", sample.force_n[0], sample.force_n[1],
//                                    sample.force_n[2]);
//   }
//   tagwrench_close(device);
//
// C99, no globals of its own. One device belongs to one thread at a time.
//
// Units   SI: N, N m, ns.
// Frame   force and torque are what the user applies TO the platform, about the wrench origin and
//         along the axes of the sensor's wrench frame. Where its sensor.yaml names no other, that
//         is the platform's origin at rest and the camera's axes: x right, y down, z away from the
//         lens, right-handed. (The virtual SpaceMouse has other axes: those of HID.)
// Time    CLOCK_MONOTONIC of the computer that the camera is plugged into.
#ifndef TAGWRENCH_HID_H
#define TAGWRENCH_HID_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define TAGWRENCH_API __attribute__((visibility("default")))
#else
#define TAGWRENCH_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

// HID identity of the device (bus USB; application collection: usage 0x10 of page 0xff00).
#define TAGWRENCH_VENDOR_ID 0x1209
#define TAGWRENCH_PRODUCT_ID 0x7a6e
#define TAGWRENCH_USAGE_PAGE 0xff00
#define TAGWRENCH_REPORT_ID 0x20
#define TAGWRENCH_REPORT_SIZE 64  // bytes, report id included

// Room for any line of text of this library.
#define TAGWRENCH_TEXT_SIZE 512

// ---- One sample

typedef enum tagwrench_status {
  TAGWRENCH_OK = 0,
  TAGWRENCH_ACQUIRING = 1,  // no target seen yet
  TAGWRENCH_LOST = 2,       // had the target, or the camera, and has it no more
  TAGWRENCH_DOUBTFUL = 3,   // tracked, but the fit says not to trust it
  TAGWRENCH_SATURATED = 4   // outside the calibrated range; numbers are extrapolated
} tagwrench_status;

typedef struct tagwrench_sample {
  double force_n[3];          // Fx Fy Fz, N
  double torque_nm[3];        // Mx My Mz, N m
  double force_sigma_n[3];    // one standard deviation of each, N
  double torque_sigma_nm[3];  // N m
  int64_t capture_time_ns;    // when the camera took the picture; see Time above. 0: of no picture,
                              // a neutral sample that says the bridge hangs or has ended
  uint32_t sequence;          // counts captured frames, modulo 2^31; 0 if of no picture
  uint32_t lost;              // frames lost right before this one; 65535: that many or more
  tagwrench_status status;
  bool has_numbers;  // status is ok or saturated; with every other one all numbers above are zero
                     // and mean nothing
} tagwrench_sample;

// What functions return that can fail: above zero a sample, zero none, below zero one of these.
enum {
  TAGWRENCH_ERROR_SIZE = -1,    // not 64 bytes
  TAGWRENCH_ERROR_REPORT = -2,  // another report id
  TAGWRENCH_ERROR_FIELD = -3,   // a field is outside the range that the descriptor declares
  TAGWRENCH_ERROR_GONE = -4     // unplugged, or the bridge has ended: close it and open it again
};

// The 64 bytes of one input report, report id first, into SI. Pure: no device needed, any bytes
// may come. Returns 1, or an error; then `sample` is left alone.
TAGWRENCH_API int tagwrench_decode(const uint8_t* report, size_t size, tagwrench_sample* sample);

// "ok", "acquiring", "lost", "doubtful", "saturated"; "?" for anything else. Lives for ever.
TAGWRENCH_API const char* tagwrench_status_name(tagwrench_status status);

// Frames between two sequence numbers that follow each other: 0 for neighbours and for the same one
// twice. The numbers turn over at 2^31; more than 2^30 missing ones are taken for a restart: 0.
TAGWRENCH_API uint32_t tagwrench_missing(uint32_t earlier, uint32_t later);

// CLOCK_MONOTONIC now. Minus a sample's capture_time_ns it is the sample's age, where the sensor is
// on this computer and live.
TAGWRENCH_API int64_t tagwrench_now_ns(void);

// In words, for an error above. Lives for ever.
TAGWRENCH_API const char* tagwrench_error_text(int error);

// ---- Devices

typedef struct tagwrench_device_info {
  char path[256];    // "/dev/hidraw3"
  char serial[256];  // UTF-8; tells two sensors apart
  char name[256];    // UTF-8
  uint16_t vendor_id;
  uint16_t product_id;
} tagwrench_device_info;

typedef struct tagwrench_device tagwrench_device;

// Fills in up to `capacity` wrench sensors that are plugged in, whether they may be opened or not.
// Returns how many there are, which may be more. `devices` may be NULL if `capacity` is 0.
TAGWRENCH_API size_t tagwrench_enumerate(tagwrench_device_info* devices, size_t capacity);

// The sensor with this serial, or the first one if `serial` is NULL. NULL if there is none, or if
// it may not be opened: `why` (TAGWRENCH_TEXT_SIZE bytes do) then has one line with the remedy.
TAGWRENCH_API tagwrench_device* tagwrench_open(const char* serial, char* why, size_t why_size);

// The same by path, for a sensor with an id of its own.
TAGWRENCH_API tagwrench_device* tagwrench_open_path(const char* path, char* why, size_t why_size);

// The next sample in order; waits up to `timeout_ms` for it, for ever if that is negative. Returns
// 1, 0 (none in time, or a signal came), or TAGWRENCH_ERROR_GONE. Reports that do not decode are
// skipped and counted, see tagwrench_strangers(). The kernel keeps 64 reports: a reader that is
// away for longer loses the oldest, and tagwrench_missing() shows it.
TAGWRENCH_API int tagwrench_read(tagwrench_device* device, tagwrench_sample* sample,
                                 int timeout_ms);

// The same, but if several samples are waiting the newest of them: for control loops and displays
// that must not act on the past. `skipped`, which may be NULL, is how many older ones that cost.
TAGWRENCH_API int tagwrench_read_newest(tagwrench_device* device, tagwrench_sample* sample,
                                        int timeout_ms, uint32_t* skipped);

// Of an open device. Valid until it is closed.
TAGWRENCH_API const tagwrench_device_info* tagwrench_info(const tagwrench_device* device);
TAGWRENCH_API uint64_t tagwrench_strangers(const tagwrench_device* device);

// Closes it; NULL is allowed.
TAGWRENCH_API void tagwrench_close(tagwrench_device* device);

#ifdef __cplusplus
}
#endif

#endif
