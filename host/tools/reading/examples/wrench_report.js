// Decodes the input report of a tagwrench wrench sensor. No dependencies; a classic script, so that a page opened from a
// folder may load it, and node may require() it.
"use strict";

const WRENCH = {
  vendorId: 0x1209,
  productId: 0x7a6e,
  usagePage: 0xff00,
  reportId: 0x20,
  size: 63, // bytes; WebHID hands over the report without its id
  status: ["ok", "acquiring", "lost", "doubtful", "saturated"],
};

/**
 * @param {number} reportId
 * @param {DataView} data what follows the report id
 * @returns the sample, or null if this is not a report of the sensor. Force (N) and torque (N m) are what the user applies
 *   to the platform, about the wrench origin, along the axes of the sensor's wrench frame; sigmas are one standard
 *   deviation. captureTime_s counts on CLOCK_MONOTONIC of the computer with the camera (performance.now() has another
 *   origin); 0 is of no picture, a neutral sample. sequence is modulo 2^31. Numbers are zero and mean nothing unless hasNumbers.
 */
function decodeWrench(reportId, data) {
  if (reportId !== WRENCH.reportId || data.byteLength !== WRENCH.size) return null;
  const counts = (offset, get) => [0, 4, 8].map((i) => data[get](offset + i, true));
  const force = counts(0, "getInt32");
  const torque = counts(12, "getInt32");
  const forceSigma = counts(24, "getUint32");
  const torqueSigma = counts(36, "getUint32");
  const seconds = data.getUint32(48, true);
  const microseconds = data.getUint32(52, true);
  const sequence = data.getUint32(56, true);
  const lost = data.getUint16(60, true);
  const status = data.getUint8(62);
  const largest = 0x7fffffff;
  const inRange =
    [...force, ...torque].every((count) => count >= -largest) &&
    [...forceSigma, ...torqueSigma, seconds, sequence].every((count) => count <= largest) &&
    microseconds < 1e6 &&
    status < WRENCH.status.length;
  if (!inRange) return null;
  const hasNumbers = status === 0 || status === 4;
  const si = (values) => values.map((count) => (hasNumbers ? count / 1e6 : 0));
  return {
    force_n: si(force),
    torque_nm: si(torque),
    forceSigma_n: si(forceSigma),
    torqueSigma_nm: si(torqueSigma),
    captureTime_s: seconds + microseconds / 1e6,
    sequence,
    lost,
    status: WRENCH.status[status],
    hasNumbers,
  };
}

if (typeof module !== "undefined") module.exports = { WRENCH, decodeWrench };
