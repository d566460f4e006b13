// Analogue inputs: measurements become samples with a sequence.
#pragma once

#include "firmware/app/link.h"

namespace tagwrench {
namespace firmware {

constexpr uint8_t kMaxAdcChannels = 2;

class Adc {
 public:
  void poll(Link& link) {
    board::Measurement measured;
    if (!board::adc_take(measured)) return;
    link.count_dropped(measured.lost);
    uint16_t& sequence = sequence_[measured.channel];
    sequence = static_cast<uint16_t>(sequence + measured.lost);
    link.send(link::AdcSample{measured.channel, measured.counts, measured.time_us, sequence});
    ++sequence;
  }

 private:
  uint16_t sequence_[kMaxAdcChannels] = {};  ///< of the next one
};

}  // namespace firmware
}  // namespace tagwrench
