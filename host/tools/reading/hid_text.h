// Words about HID devices that the library and `tagwrench read` share. Not part of its interface.
#ifndef TAGWRENCH_HID_TEXT_H
#define TAGWRENCH_HID_TEXT_H

#include <stddef.h>
#include <stdint.h>
#include <wchar.h>

#ifdef __cplusplus
extern "C" {
#endif

// UTF-8 of what a device says about itself, cut at whole characters; NULL is "". Control
// characters become '?': any device may be plugged in, and this goes to a terminal.
void tagwrench_utf8(const wchar_t* text, char* out, size_t size);

// One line: why the node at `path`, of a device with this id (0:0 if not known), does not open for
// reading and writing, and what to do.
void tagwrench_why_not_open(const char* path, uint16_t vendor, uint16_t product, char* why,
                            size_t size);

#ifdef __cplusplus
}
#endif

#endif
