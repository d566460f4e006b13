// One sample as the bridge sends it and as the browser's own tracker makes it, and the one table of the six
// axes.

export type Status = 'ok' | 'acquiring' | 'lost' | 'doubtful' | 'saturated';
export type ZeroState = 'off' | 'touched' | 'far' | 'following';

/**
 * Units are SI. Three-vectors are x, y, z along camera axes; six-vectors are translation before rotation,
 * force before torque.
 */
export interface Sample {
  seq: number;
  /** Capture time. */
  t_ns: number;
  status: Status;
  d_m: readonly number[];
  d_rad: readonly number[];
  /** One standard deviation of the displacement: three in m, three in rad. */
  d_sigma: readonly number[];
  f_n: readonly number[];
  m_nm: readonly number[];
  /** One standard deviation of the wrench: three in N, three in N m. */
  w_sigma: readonly number[];
  dropped: number;
  latency_us: number;
  /** What has been taken off the wrench: three in N, three in N m. */
  zero?: readonly number[];
  zero_state?: ZeroState;
  /** -1..1 for each axis of the input device. */
  motion?: readonly number[];
  /** Bit 0 is the first button. */
  buttons?: number;
  residual_px?: number;
  tags_held?: number;
}

/** Only these two carry numbers; every other status is a neutral output. */
export function carriesNumbers(status: Status): boolean {
  return status === 'ok' || status === 'saturated';
}

export const STATUS_WORDS: Readonly<Record<Status, string>> = {
  ok: 'ok',
  acquiring: 'looking for the tags',
  lost: 'lost: tags or camera out of reach',
  doubtful: 'doubtful: not trusted, outputs neutral',
  saturated: 'saturated: outside the calibrated range',
};

export const ZERO_WORDS: Readonly<Record<ZeroState, string>> = {
  off: 'set, stays',
  touched: 'kept while touched',
  far: 'kept: far off; press zero with hands off',
  following: 'follows slow drift',
};

export interface Axis {
  name: 'Fx' | 'Fy' | 'Fz' | 'Mx' | 'My' | 'Mz';
  /** Spoken by screen readers. */
  title: string;
  unit: 'N' | 'mN m';
  /** From SI to `unit`. */
  scale: number;
  /** Of a value in `unit`. */
  decimals: number;
  /** The variable of theme.css that holds its colour. */
  colour: string;
}

export const AXES: readonly Axis[] = [
  { name: 'Fx', title: 'force along x', unit: 'N', scale: 1, decimals: 3, colour: '--axis-fx' },
  { name: 'Fy', title: 'force along y', unit: 'N', scale: 1, decimals: 3, colour: '--axis-fy' },
  { name: 'Fz', title: 'force along z', unit: 'N', scale: 1, decimals: 3, colour: '--axis-fz' },
  { name: 'Mx', title: 'torque about x', unit: 'mN m', scale: 1e3, decimals: 2, colour: '--axis-mx' },
  { name: 'My', title: 'torque about y', unit: 'mN m', scale: 1e3, decimals: 2, colour: '--axis-my' },
  { name: 'Mz', title: 'torque about z', unit: 'mN m', scale: 1e3, decimals: 2, colour: '--axis-mz' },
];

/** SI; axis 0..5. */
export function wrenchOf(sample: Sample, axis: number): number {
  return (axis < 3 ? sample.f_n[axis] : sample.m_nm[axis - 3]) ?? Number.NaN;
}

/** A number as people read it, of a width that stays; the minus is as wide as a digit. */
export function figure(value: number, decimals: number): string {
  if (!Number.isFinite(value)) return '–';
  const text = Math.abs(value).toFixed(decimals);
  const nothing = !/[1-9]/.test(text);
  return value < 0 && !nothing ? `\u2212${text}` : text;
}

function vector(value: unknown, length: number): readonly number[] | null {
  if (!Array.isArray(value) || value.length !== length) return null;
  return value.every((v) => typeof v === 'number') ? (value as number[]) : null;
}

function count(value: unknown): number | null {
  return typeof value === 'number' && Number.isFinite(value) ? value : null;
}

/** What has come over the wire, or null if it is no sample. Optional parts that are wrong are left out. */
export function sampleFrom(value: unknown): Sample | null {
  if (typeof value !== 'object' || value === null) return null;
  const said = value as Record<string, unknown>;
  const [seq, t_ns, dropped, latency_us] = [said.seq, said.t_ns, said.dropped ?? 0, said.latency_us ?? 0].map(
    count,
  );
  const [d_m, d_rad, f_n, m_nm] = [said.d_m, said.d_rad, said.f_n, said.m_nm].map((v) => vector(v, 3));
  const [d_sigma, w_sigma] = [said.d_sigma, said.w_sigma].map((v) => vector(v, 6));
  if (seq == null || t_ns == null || dropped == null || latency_us == null) return null;
  if (!d_m || !d_rad || !f_n || !m_nm || !d_sigma || !w_sigma) return null;
  if (typeof said.status !== 'string' || !Object.hasOwn(STATUS_WORDS, said.status)) return null;
  const sample: Sample = {
    seq,
    t_ns,
    status: said.status as Status,
    d_m,
    d_rad,
    d_sigma,
    f_n,
    m_nm,
    w_sigma,
    dropped,
    latency_us,
  };
  const zero = vector(said.zero, 6);
  if (zero) sample.zero = zero;
  const motion = vector(said.motion, 6);
  if (motion) sample.motion = motion;
  if (typeof said.zero_state === 'string' && Object.hasOwn(ZERO_WORDS, said.zero_state)) {
    sample.zero_state = said.zero_state as ZeroState;
  }
  for (const key of ['buttons', 'residual_px', 'tags_held'] as const) {
    const number = count(said[key]);
    if (number != null) sample[key] = number;
  }
  return sample;
}
