// The messages of protocol/link.proto that this page needs, as protobuf has them. Whatever comes: nothing is read beyond a
// message's end, unknown fields are skipped, and a message that is none is null.

export const Kind = {
  helloRequest: 0x01, configure: 0x02, led: 0x03, timeRequest: 0x04, tare: 0x05,
  hello: 0x81, capabilities: 0x82, cellSample: 0x83, status: 0x87, answer: 0x88, tareResult: 0x89, fault: 0x8a,
} as const;

export const PROTOCOL_MAJOR = 1;

type Value = number | Uint8Array;
type Fields = Map<number, Value>;

class Writer {
  private readonly bytes: number[] = [];

  varint(field: number, value: number): this {
    if (value === 0) return this; // proto3: not sent
    this.raw(field << 3);
    return this.raw(value);
  }
  fixed32(field: number, value: number): this {
    if (value === 0) return this;
    this.raw((field << 3) | 5);
    for (let shift = 0; shift < 32; shift += 8) this.bytes.push((value >>> shift) & 0xff);
    return this;
  }
  packed(field: number, values: readonly number[]): this {
    const inner = new Writer();
    values.forEach((value) => inner.raw(value));
    this.raw((field << 3) | 2).raw(inner.bytes.length);
    this.bytes.push(...inner.bytes);
    return this;
  }
  done(): Uint8Array {
    return Uint8Array.from(this.bytes);
  }
  private raw(value: number): this {
    let rest = value >>> 0;
    for (; rest > 0x7f; rest >>>= 7) this.bytes.push((rest & 0x7f) | 0x80);
    this.bytes.push(rest);
    return this;
  }
}

export const helloRequest = (session: number): Uint8Array => new Writer().varint(1, PROTOCOL_MAJOR).fixed32(3, session).done();

/** Cells with channel A and gain 128 in all places that the board has. */
export function configure(cells: number, hostTimeout_ms: number, status_ms: number): Uint8Array {
  const writer = new Writer().varint(1, hostTimeout_ms);
  if (cells > 0) writer.packed(2, new Array<number>(cells).fill(1));
  return writer.varint(3, 10).varint(6, status_ms).done();
}

export const steadyLight = (permille: number): Uint8Array =>
  permille > 0 ? new Writer().varint(1, 1).varint(2, permille).done() : new Uint8Array(0);

export const tare = (mask: number, conversions: number): Uint8Array => new Writer().varint(1, mask).varint(2, conversions).done();

class Reader {
  private at = 0;
  constructor(private readonly bytes: Uint8Array) {}

  get ended(): boolean {
    return this.at >= this.bytes.length;
  }
  /** Up to 64 bits, of which 32 matter here; null beyond the end or if it never ends. */
  varint(): number | null {
    let value = 0;
    for (let count = 0; count < 10; count++) {
      const byte = this.bytes[this.at++];
      if (byte === undefined) return null;
      if (count < 5) value += (byte & 0x7f) * 2 ** (7 * count);
      if (byte < 0x80) return value;
    }
    return null;
  }
  take(count: number): Uint8Array | null {
    if (count > this.bytes.length - this.at) return null;
    this.at += count;
    return this.bytes.subarray(this.at - count, this.at);
  }
}

/** Of a field that comes twice, the last one counts. */
function fields(message: Uint8Array): Fields | null {
  const reader = new Reader(message);
  const found: Fields = new Map();
  while (!reader.ended) {
    const tag = reader.varint();
    if (tag === null || tag >>> 3 === 0) return null;
    const type = tag & 7;
    let value: Value | null = null;
    if (type === 0) value = reader.varint();
    else if (type === 2) {
      const length = reader.varint();
      value = length === null ? null : reader.take(length);
    } else if (type === 5) {
      const four = reader.take(4);
      value = four && new DataView(four.buffer, four.byteOffset, 4).getUint32(0, true);
    } else if (type === 1) value = reader.take(8);
    if (value === null) return null;
    found.set(tag >>> 3, value);
  }
  return found;
}

const number = (from: Fields, field: number): number => {
  const value = from.get(field);
  return typeof value === 'number' ? value : 0;
};
const signed = (from: Fields, field: number): number => {
  const zigzag = number(from, field) >>> 0;
  return (zigzag >>> 1) ^ -(zigzag & 1);
};
const text = (from: Fields, field: number): string => {
  const value = from.get(field);
  // A stranger's bytes: what does not print is not shown.
  return value instanceof Uint8Array ? [...value].map((b) => (b >= 0x20 && b < 0x7f ? String.fromCharCode(b) : '?')).join('') : '';
};

export type BoardNews =
  | { kind: 'hello'; major: number; minor: number; board: string; firmware: string; bootId: number; session: number }
  | { kind: 'capabilities'; cells: number; ledLevels: number; ledSustained_permille: number }
  | { kind: 'cell'; channel: number; counts: number; time_us: number; saturated: boolean }
  | { kind: 'status'; session: number; led_permille: number; limited: boolean; supply_mv: number }
  | { kind: 'answer'; request: number; result: number }
  | { kind: 'tare'; channel: number; mean_counts: number; spread_counts: number }
  | { kind: 'fault'; code: number; channel: number };

export function readNews(kind: number, message: Uint8Array): BoardNews | null {
  const f = fields(message);
  if (!f) return null;
  switch (kind) {
    case Kind.hello:
      return {
        kind: 'hello', major: number(f, 1), minor: number(f, 2), board: text(f, 3), firmware: text(f, 4),
        bootId: number(f, 6), session: number(f, 8),
      };
    case Kind.capabilities:
      return { kind: 'capabilities', cells: Math.min(number(f, 1), 8), ledLevels: number(f, 5), ledSustained_permille: number(f, 6) };
    case Kind.cellSample:
      return { kind: 'cell', channel: number(f, 1), counts: signed(f, 2), time_us: number(f, 3), saturated: number(f, 6) !== 0 };
    case Kind.status:
      return { kind: 'status', session: number(f, 2), led_permille: number(f, 3), limited: number(f, 4) !== 0, supply_mv: number(f, 6) };
    case Kind.answer:
      return { kind: 'answer', request: number(f, 1), result: number(f, 3) };
    case Kind.tareResult:
      return { kind: 'tare', channel: number(f, 1), mean_counts: signed(f, 2), spread_counts: number(f, 3) };
    case Kind.fault:
      return { kind: 'fault', code: number(f, 1), channel: number(f, 2) };
    default:
      return null; // of a later version
  }
}
