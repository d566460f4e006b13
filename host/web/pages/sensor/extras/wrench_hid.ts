// The bridge's wrench sensor on HID, read by WebHID: its report in newtons (host/tools/reading/README.md).
import { STATUS_WORDS, type Sample, type Status, carriesNumbers } from '../../common/sample';

const VENDOR = 0x1209;
const PRODUCT = 0x7a6e;
const USAGE_PAGE = 0xff00;
const REPORT = 0x20;
const BYTES = 63;
const MICRO = 1e-6;
const LARGEST = 0x7fffffff;
const STATUSES = Object.keys({ ok: 0, acquiring: 0, lost: 0, doubtful: 0, saturated: 0 } satisfies Record<Status, number>) as Status[];

/** The sample of a report, or null if it is none of ours. Its displacement is not in the report: zero. */
export function decodeReport(id: number, data: DataView): Sample | null {
  if (id !== REPORT || data.byteLength !== BYTES) return null;
  const many = (from: number, get: (at: number) => number): number[] => [0, 4, 8, 12, 16, 20].map((at) => get(from + at));
  const wrench = many(0, (at) => data.getInt32(at, true));
  const sigma = many(24, (at) => data.getUint32(at, true));
  const [seconds, microseconds, seq] = [48, 52, 56].map((at) => data.getUint32(at, true)) as [number, number, number];
  const status = STATUSES[data.getUint8(62)];
  const outside = wrench.some((v) => v < -LARGEST) || [...sigma, seconds, seq].some((v) => v > LARGEST) || microseconds >= 1e6;
  if (outside || !status) return null;
  const si = (values: number[]): number[] => values.map((value) => (carriesNumbers(status) ? value * MICRO : 0));
  const [f, m] = [si(wrench.slice(0, 3)), si(wrench.slice(3))];
  const none = [0, 0, 0];
  return {
    seq, t_ns: seconds * 1e9 + microseconds * 1e3, status, d_m: none, d_rad: none, d_sigma: [...none, ...none],
    f_n: f, m_nm: m, w_sigma: si(sigma), dropped: data.getUint16(60, true), latency_us: 0,
  };
}

export class WrenchHid {
  private device: HIDDevice | null = null;

  constructor(private readonly onSample: (sample: Sample) => void, private readonly say: (line: string) => void) {
    navigator.hid.addEventListener('disconnect', ({ device }) => {
      if (device === this.device) this.say('unplugged, or the bridge has ended');
    });
    navigator.hid.addEventListener('connect', ({ device }) => {
      if (this.device && device.vendorId === VENDOR && device.productId === PRODUCT) void this.open(device);
    });
  }

  /** Asks the user which. */
  async connect(): Promise<void> {
    const filters = [{ vendorId: VENDOR, productId: PRODUCT, usagePage: USAGE_PAGE }];
    const [device] = await navigator.hid.requestDevice({ filters });
    if (device) await this.open(device);
    else this.say('no wrench sensor was chosen; it is there while the bridge runs with --output wrench');
  }

  private async open(device: HIDDevice): Promise<void> {
    try {
      if (!device.opened) await device.open();
    } catch (error) {
      this.say(`it cannot be opened (${error instanceof Error ? error.message : String(error)}); on Linux it takes the udev rule of the package`);
      return;
    }
    this.device = device;
    this.say(`${device.productName}: ${STATUS_WORDS.acquiring}`);
    device.oninputreport = ({ reportId, data }) => {
      const sample = decodeReport(reportId, data);
      if (!sample) return;
      this.say(`${device.productName}: ${STATUS_WORDS[sample.status]}`);
      this.onSample(sample);
    };
  }
}
