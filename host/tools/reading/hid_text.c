#include "host/tools/reading/hid_text.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

// One character (RFC 3629); returns its bytes.
static size_t encode(uint32_t c, char out[4]) {
  const int control = c < 0x20 || (c >= 0x7f && c < 0xa0);
  if (control || c > 0x10ffff || (c >= 0xd800 && c < 0xe000)) c = '?';
  if (c < 0x80) {
    out[0] = (char)c;
    return 1;
  }
  const size_t more = c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
  for (size_t i = more; i > 0; --i, c >>= 6) out[i] = (char)(0x80 | (c & 0x3f));
  out[0] = (char)((0xff00u >> (more + 1)) | c);
  return more + 1;
}

void tagwrench_utf8(const wchar_t* text, char* out, size_t size) {
  if (size == 0) return;
  size_t used = 0;
  for (; text != NULL && *text != L'\0'; ++text) {
    char bytes[4];
    const size_t count = encode((uint32_t)*text, bytes);
    if (used + count >= size) break;
    memcpy(out + used, bytes, count);
    used += count;
  }
  out[used] = '\0';
}

// Our own rules name the bridge's devices; for another one the rule is spelt out.
static void say_rule(const char* path, uint16_t vendor, uint16_t product, char* why, size_t size) {
  const int ours = (vendor == 0 && product == 0) || (vendor == 0x1209 && product == 0x7a6e) ||
                   (vendor == 0x256f && product == 0xc62e);
  if (ours) {
    snprintf(why, size,
             "%s: no permission; install 70-tagwrench.rules in /etc/udev/rules.d (it lets in the "
             "user at the seat and the group tagwrench), or run as root",
             path);
    return;
  }
  snprintf(why, size,
           "%s: no permission; put this line into /etc/udev/rules.d/70-puck.rules and plug it in "
           "again: SUBSYSTEM==\"hidraw\", KERNELS==\"*:%04X:%04X.*\", GROUP=\"input\", "
           "MODE=\"0660\", TAG+=\"uaccess\"",
           path, vendor, product);
}

void tagwrench_why_not_open(const char* path, uint16_t vendor, uint16_t product, char* why,
                            size_t size) {
  if (access(path, R_OK | W_OK) == 0) {
    snprintf(why, size, "%s: does not open as a HID device; plug it in again", path);
    return;
  }
  switch (errno) {
    case EACCES:
    case EPERM: say_rule(path, vendor, product, why, size); break;
    case ENOENT:
      snprintf(why, size, "%s: not there; `tagwrench read --list` says what is", path);
      break;
    default: snprintf(why, size, "%s: %s; check it with: ls -l %s", path, strerror(errno), path);
  }
}
