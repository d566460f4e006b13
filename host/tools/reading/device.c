#include <errno.h>
#include <hidapi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/tools/reading/hid_text.h"
#include "host/tools/reading/tagwrench_hid.h"

struct tagwrench_device {
  hid_device* hid;
  tagwrench_device_info info;
  uint64_t strangers;
};

// Reports that are drained at once: the kernel keeps 64, the rest came meanwhile.
enum { kMaxDrained = 256 };

// hidapi's libusb backend knows no usages and says 0. A device without a path went while it was
// looked at.
static bool is_wrench(const struct hid_device_info* d) {
  return d->path != NULL && d->vendor_id == TAGWRENCH_VENDOR_ID &&
         d->product_id == TAGWRENCH_PRODUCT_ID &&
         (d->usage_page == TAGWRENCH_USAGE_PAGE || d->usage_page == 0);
}

static void describe(const struct hid_device_info* d, tagwrench_device_info* info) {
  snprintf(info->path, sizeof info->path, "%s", d->path);
  tagwrench_utf8(d->serial_number, info->serial, sizeof info->serial);
  tagwrench_utf8(d->product_string, info->name, sizeof info->name);
  info->vendor_id = d->vendor_id;
  info->product_id = d->product_id;
}

size_t tagwrench_enumerate(tagwrench_device_info* devices, size_t capacity) {
  struct hid_device_info* all = hid_enumerate(TAGWRENCH_VENDOR_ID, TAGWRENCH_PRODUCT_ID);
  size_t count = 0;
  for (const struct hid_device_info* d = all; d != NULL; d = d->next) {
    if (!is_wrench(d)) continue;
    if (count < capacity) describe(d, &devices[count]);
    ++count;
  }
  hid_free_enumeration(all);
  return count;
}

static tagwrench_device* open_described(const tagwrench_device_info* info, char* why, size_t size) {
  tagwrench_device* device = calloc(1, sizeof *device);
  if (device == NULL) {
    snprintf(why, size, "%s: out of memory", info->path);
    return NULL;
  }
  device->info = *info;
  device->hid = hid_open_path(info->path);
  if (device->hid != NULL) return device;
  tagwrench_why_not_open(info->path, info->vendor_id, info->product_id, why, size);
  free(device);
  return NULL;
}

// What does not fit is cut off.
static void append(const char* text, char* to, size_t size) {
  strncat(to, text, size - strlen(to) - 1);
}

tagwrench_device* tagwrench_open(const char* serial, char* why, size_t why_size) {
  tagwrench_device_info found;
  char there[256] = "";
  bool match = false;
  struct hid_device_info* all = hid_enumerate(TAGWRENCH_VENDOR_ID, TAGWRENCH_PRODUCT_ID);
  for (const struct hid_device_info* d = all; d != NULL && !match; d = d->next) {
    if (!is_wrench(d)) continue;
    describe(d, &found);
    match = serial == NULL || strcmp(serial, found.serial) == 0;
    append(there[0] == '\0' ? "" : ", ", there, sizeof there);
    append(found.serial, there, sizeof there);
  }
  hid_free_enumeration(all);
  if (match) return open_described(&found, why, why_size);
  if (there[0] != '\0') {
    snprintf(why, why_size, "no wrench sensor has the serial '%s'; there is: %s", serial, there);
  } else {
    snprintf(why, why_size,
             "no wrench sensor (HID device %04x:%04x) is here; start the bridge with an output "
             "`wrench`",
             TAGWRENCH_VENDOR_ID, TAGWRENCH_PRODUCT_ID);
  }
  return NULL;
}

tagwrench_device* tagwrench_open_path(const char* path, char* why, size_t why_size) {
  tagwrench_device_info info;
  memset(&info, 0, sizeof info);
  snprintf(info.path, sizeof info.path, "%s", path);
  struct hid_device_info* all = hid_enumerate(0, 0);
  for (const struct hid_device_info* d = all; d != NULL; d = d->next) {
    if (d->path != NULL && strcmp(d->path, path) == 0) describe(d, &info);
  }
  hid_free_enumeration(all);
  return open_described(&info, why, why_size);
}

// What is left of a wait that ends at `end_ns`.
static int left_ms(int64_t end_ns) {
  const int64_t left = (end_ns - tagwrench_now_ns() + 999999) / 1000000;
  return left > 0 ? (int)left : 0;
}

int tagwrench_read(tagwrench_device* device, tagwrench_sample* sample, int timeout_ms) {
  const int64_t end_ns = tagwrench_now_ns() + (int64_t)timeout_ms * 1000000;
  for (;;) {
    // One byte more than there is room for in a report of ours: a longer one is seen as such.
    uint8_t report[TAGWRENCH_REPORT_SIZE + 1];
    errno = 0;
    const int size =
        hid_read_timeout(device->hid, report, sizeof report, timeout_ms < 0 ? -1 : left_ms(end_ns));
    if (size < 0) return errno == EINTR ? 0 : TAGWRENCH_ERROR_GONE;
    if (size == 0) return 0;
    if (tagwrench_decode(report, (size_t)size, sample) > 0) return 1;
    ++device->strangers;
  }
}

int tagwrench_read_newest(tagwrench_device* device, tagwrench_sample* sample, int timeout_ms,
                          uint32_t* skipped) {
  uint32_t older = 0;
  const int first = tagwrench_read(device, sample, timeout_ms);
  while (first > 0 && older < kMaxDrained && tagwrench_read(device, sample, 0) > 0) ++older;
  if (skipped != NULL) *skipped = older;
  return first;
}

const tagwrench_device_info* tagwrench_info(const tagwrench_device* device) {
  return &device->info;
}

uint64_t tagwrench_strangers(const tagwrench_device* device) { return device->strangers; }

void tagwrench_close(tagwrench_device* device) {
  if (device == NULL) return;
  hid_close(device->hid);
  free(device);
}
