// The ports' bits as avr-libc names them: what firmware/board/atmega328p/pins.h needs of it.
#pragma once

#include <stdint.h>

enum PortBit : uint8_t {
  PB0,
  PB1,
  PB2,
  PB3,
  PB4,
  PB5,
  PC0 = 0,
  PC1,
  PC2,
  PC3,
  PC4,
  PC5,
  PD0 = 0,
  PD1,
  PD2,
  PD3,
  PD4,
  PD5,
  PD6,
  PD7,
};
