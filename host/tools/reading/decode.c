#include <time.h>

#include "host/tools/reading/tagwrench_hid.h"

// Bytes of the report; the layout is tabled in host/output/hid_report.h. Little-endian.
enum {
  kAtForce = 1,
  kAtTorque = 13,
  kAtForceSigma = 25,
  kAtTorqueSigma = 37,
  kAtSeconds = 49,
  kAtMicroseconds = 53,
  kAtSequence = 57,
  kAtLost = 61,
  kAtStatus = 63
};

static const double kMicro = 1e6;  // counts per N, N m
static const uint32_t kSequenceMask = 0x7fffffffu;

static uint32_t u32_at(const uint8_t* bytes) {
  return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
         (uint32_t)bytes[3] << 24;
}

static int32_t i32_at(const uint8_t* bytes) {
  const uint32_t bits = u32_at(bytes);
  return bits <= INT32_MAX ? (int32_t)bits : -(int32_t)(~bits) - 1;
}

// Three signed counts of 1e-6; false outside the declared range, which is symmetric.
static bool signed_si(const uint8_t* bytes, double out[3]) {
  for (int i = 0; i < 3; ++i) {
    const int32_t counts = i32_at(bytes + 4 * i);
    if (counts == INT32_MIN) return false;
    out[i] = counts / kMicro;
  }
  return true;
}

static bool unsigned_si(const uint8_t* bytes, double out[3]) {
  for (int i = 0; i < 3; ++i) {
    const uint32_t counts = u32_at(bytes + 4 * i);
    if (counts > INT32_MAX) return false;
    out[i] = counts / kMicro;
  }
  return true;
}

static void take_numbers_away(tagwrench_sample* sample) {
  for (int i = 0; i < 3; ++i) {
    sample->force_n[i] = sample->torque_nm[i] = 0;
    sample->force_sigma_n[i] = sample->torque_sigma_nm[i] = 0;
  }
}

int tagwrench_decode(const uint8_t* report, size_t size, tagwrench_sample* sample) {
  if (size != TAGWRENCH_REPORT_SIZE) return TAGWRENCH_ERROR_SIZE;
  if (report[0] != TAGWRENCH_REPORT_ID) return TAGWRENCH_ERROR_REPORT;

  tagwrench_sample got;
  const uint32_t seconds = u32_at(report + kAtSeconds);
  const uint32_t microseconds = u32_at(report + kAtMicroseconds);
  const uint8_t status = report[kAtStatus];
  got.sequence = u32_at(report + kAtSequence);
  got.lost = (uint32_t)report[kAtLost] | (uint32_t)report[kAtLost + 1] << 8;
  const bool in_range =
      signed_si(report + kAtForce, got.force_n) && signed_si(report + kAtTorque, got.torque_nm) &&
      unsigned_si(report + kAtForceSigma, got.force_sigma_n) &&
      unsigned_si(report + kAtTorqueSigma, got.torque_sigma_nm) && seconds <= INT32_MAX &&
      microseconds < 1000000u && got.sequence <= kSequenceMask && status <= TAGWRENCH_SATURATED;
  if (!in_range) return TAGWRENCH_ERROR_FIELD;

  got.capture_time_ns = (int64_t)seconds * 1000000000 + (int64_t)microseconds * 1000;
  got.status = (tagwrench_status)status;
  got.has_numbers = got.status == TAGWRENCH_OK || got.status == TAGWRENCH_SATURATED;
  if (!got.has_numbers) take_numbers_away(&got);
  *sample = got;
  return 1;
}

const char* tagwrench_status_name(tagwrench_status status) {
  switch (status) {
    case TAGWRENCH_OK: return "ok";
    case TAGWRENCH_ACQUIRING: return "acquiring";
    case TAGWRENCH_LOST: return "lost";
    case TAGWRENCH_DOUBTFUL: return "doubtful";
    case TAGWRENCH_SATURATED: return "saturated";
  }
  return "?";
}

uint32_t tagwrench_missing(uint32_t earlier, uint32_t later) {
  const uint32_t step = (later - earlier) & kSequenceMask;
  return step == 0 || step > kSequenceMask / 2 ? 0 : step - 1;
}

int64_t tagwrench_now_ns(void) {
  struct timespec now;
  if (clock_gettime(CLOCK_MONOTONIC, &now) != 0) return 0;
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

const char* tagwrench_error_text(int error) {
  switch (error) {
    case TAGWRENCH_ERROR_SIZE: return "the report is not 64 bytes long";
    case TAGWRENCH_ERROR_REPORT: return "the report is of another kind";
    case TAGWRENCH_ERROR_FIELD: return "the report has a value outside its declared range";
    case TAGWRENCH_ERROR_GONE: return "the device is gone: unplugged, or the bridge has ended";
    default: return "no error";
  }
}
