// Frames of the board's link (protocol/README.md): COBS(kind sequence message CRC-16) 00.

/** A whole frame with its code byte and delimiter. */
const MOST_FRAME_BYTES = 86;
const MOST_MESSAGE_BYTES = 80;
const HEADER_BYTES = 2;
const CRC_BYTES = 2;

export interface BoardFrame {
  kind: number;
  sequence: number;
  message: Uint8Array;
}

/** CRC-16/IBM-3740: polynomial 0x1021, start 0xFFFF. */
export function crc16(bytes: Uint8Array): number {
  let crc = 0xffff;
  for (const byte of bytes) {
    crc ^= byte << 8;
    for (let bit = 0; bit < 8; bit++) crc = (crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1) & 0xffff;
  }
  return crc;
}

export function writeFrame({ kind, sequence, message }: BoardFrame): Uint8Array {
  if (message.length > MOST_MESSAGE_BYTES) throw new Error('message too long for the board');
  const head = [kind, sequence & 0xff, ...message];
  const crc = crc16(Uint8Array.from(head));
  const out: number[] = [0];
  let code = 0;
  for (const byte of [...head, crc & 0xff, crc >> 8]) {
    if (byte === 0) {
      out[code] = out.length - code;
      code = out.length;
    }
    out.push(byte);
  }
  out[code] = out.length - code;
  return Uint8Array.from([...out, 0]);
}

/** What COBS made of it, without the delimiter; null if it cannot be. Frames are shorter than a COBS block of 254. */
function unstuff(bytes: readonly number[]): Uint8Array | null {
  const out: number[] = [];
  for (let at = 0; at < bytes.length; ) {
    const code = bytes[at] ?? 0;
    const next = at + code;
    if (code === 0 || next > bytes.length) return null;
    out.push(...bytes.slice(at + 1, next));
    at = next;
    if (at < bytes.length) out.push(0);
  }
  return Uint8Array.from(out);
}

export class FrameReader {
  /** Frames that were damaged, and dropped. */
  damaged = 0;
  private bytes: number[] = [];
  private overlong = false;

  /** The frames that these bytes complete. */
  take(chunk: Uint8Array): BoardFrame[] {
    const frames: BoardFrame[] = [];
    for (const byte of chunk) {
      if (byte !== 0) {
        if (this.bytes.length < MOST_FRAME_BYTES) this.bytes.push(byte);
        else this.overlong = true;
        continue;
      }
      if (this.bytes.length > 0) {
        const frame = this.overlong ? null : FrameReader.parse(this.bytes);
        if (frame) frames.push(frame);
        else this.damaged++;
      }
      this.bytes = [];
      this.overlong = false;
    }
    return frames;
  }

  private static parse(stuffed: readonly number[]): BoardFrame | null {
    const bytes = unstuff(stuffed);
    if (!bytes || bytes.length < HEADER_BYTES + CRC_BYTES || bytes.length > HEADER_BYTES + MOST_MESSAGE_BYTES + CRC_BYTES) return null;
    const end = bytes.length - CRC_BYTES;
    if (crc16(bytes.subarray(0, end)) !== ((bytes[end] ?? 0) | ((bytes[end + 1] ?? 0) << 8))) return null;
    return { kind: bytes[0] ?? 0, sequence: bytes[1] ?? 0, message: bytes.slice(HEADER_BYTES, end) };
  }
}
