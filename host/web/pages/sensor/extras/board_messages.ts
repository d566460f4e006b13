// What this page says to the board and hears from it, in the code that the build makes of protocol/link.proto. Whatever comes:
// nothing is read beyond a message's end, unknown fields are skipped, and a message that is none is null.
import { BinaryReader } from '@bufbuild/protobuf/wire';
import {
  Answer, Capabilities, CellInput, CellSample, Configure, Fault, Hello, HelloRequest, Led, LedMode, Status, Tare, TareResult,
} from '../../generated/protocol/link';

export const Kind = {
  helloRequest: 0x01, configure: 0x02, led: 0x03, timeRequest: 0x04, tare: 0x05,
  hello: 0x81, capabilities: 0x82, cellSample: 0x83, status: 0x87, answer: 0x88, tareResult: 0x89, fault: 0x8a,
} as const;

export const PROTOCOL_MAJOR = 1;

export const helloRequest = (session: number): Uint8Array =>
  HelloRequest.encode({ protocol_major: PROTOCOL_MAJOR, protocol_minor: 0, session }).finish();

/** Cells with channel A and gain 128 in all places that the board has. */
export const configure = (cells: number, host_timeout_ms: number, status_period_ms: number): Uint8Array =>
  Configure.encode({
    host_timeout_ms, cells: new Array<CellInput>(cells).fill(CellInput.CELL_A128), cell_rate_sps: 10, adc_mask: 0, adc_rate_hz: 0,
    status_period_ms,
  }).finish();

export const steadyLight = (permille: number): Uint8Array =>
  permille > 0
    ? Led.encode({ mode: LedMode.LED_STEADY, level_permille: permille, period_us: 0, width_us: 0, start_us: 0, pattern_seed: 0 }).finish()
    : new Uint8Array(0);

export const tare = (cell_mask: number, conversions: number): Uint8Array => Tare.encode({ cell_mask, conversions }).finish();

export type BoardNews =
  | { kind: 'hello'; major: number; minor: number; board: string; firmware: string; bootId: number; session: number }
  | { kind: 'capabilities'; cells: number; ledLevels: number; ledSustained_permille: number }
  | { kind: 'cell'; channel: number; counts: number; time_us: number; saturated: boolean }
  | { kind: 'status'; session: number; led_permille: number; limited: boolean; supply_mv: number }
  | { kind: 'answer'; request: number; result: number }
  | { kind: 'tare'; channel: number; mean_counts: number; spread_counts: number }
  | { kind: 'fault'; code: number; channel: number };

// A stranger's bytes: what does not print is not shown.
const text = (value: string): string => value.replace(/[^ -~]/g, '?');

/** Throws where the fields do not follow each other up to the very end; decode() alone would take what stands before that. */
function checkFields(message: Uint8Array): void {
  const reader = new BinaryReader(message);
  while (reader.pos < reader.len) {
    const [field, type] = reader.tag();
    reader.skip(type, field);
  }
}

function understand(kind: number, message: Uint8Array): BoardNews | null {
  checkFields(message);
  switch (kind) {
    case Kind.hello: {
      const { protocol_major, protocol_minor, board, firmware, boot_id, session } = Hello.decode(message);
      return {
        kind: 'hello', major: protocol_major, minor: protocol_minor, board: text(board), firmware: text(firmware), bootId: boot_id, session,
      };
    }
    case Kind.capabilities: {
      const { cells, led_levels, led_sustained_permille } = Capabilities.decode(message);
      return { kind: 'capabilities', cells: Math.min(cells, 8), ledLevels: led_levels, ledSustained_permille: led_sustained_permille };
    }
    case Kind.cellSample: {
      const { channel, counts, time_us, saturated } = CellSample.decode(message);
      return { kind: 'cell', channel, counts, time_us, saturated };
    }
    case Kind.status: {
      const { session, led_level_permille, led_limited, supply_mv } = Status.decode(message);
      return { kind: 'status', session, led_permille: led_level_permille, limited: led_limited, supply_mv };
    }
    case Kind.answer: {
      const { request_kind, result } = Answer.decode(message);
      return { kind: 'answer', request: request_kind, result };
    }
    case Kind.tareResult: {
      const { channel, mean_counts, spread_counts } = TareResult.decode(message);
      return { kind: 'tare', channel, mean_counts, spread_counts };
    }
    case Kind.fault: {
      const { code, channel } = Fault.decode(message);
      return { kind: 'fault', code, channel };
    }
    default:
      return null; // of a later version
  }
}

export function readNews(kind: number, message: Uint8Array): BoardNews | null {
  try {
    return understand(kind, message);
  } catch {
    return null;
  }
}
