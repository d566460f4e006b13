// The published measurement: the screen flips, and as soon as the camera sees it, it flips back. As `tagwrench camera-timing --screen`
// has it, with the browser's way of a picture in place of the kernel's.
import type { Brightness } from './brightness';

export interface FlippingPatch {
  flip(white: boolean, when_ms: number): Promise<number>;
}

export interface Figure {
  value: number;
  sigma: number;
}

export interface Result {
  frame_rate_hz: Figure;
  /** From a flip to the arrival of the picture that shows it. */
  round_trip_s: Figure;
  /** The same less half a picture's period: what is left where a change need not wait for the next picture. */
  latency_s: Figure;
  seen: number;
  missed: number;
  contrast_counts: number;
}

const SETTLE_MS = 600;
const REFERENCE_MS = 500;
const LONGEST_MS = 1500;
const PATIENCE_MS = 3000;
const LEAST_CONTRAST = 4;
const CLEARLY = 6;
const FEWEST_FLIPS = 10;

interface Level {
  mean: number;
  sigma: number;
}

function statistics(values: readonly number[]): Level {
  const mean = values.reduce((sum, value) => sum + value, 0) / Math.max(values.length, 1);
  const square = values.reduce((sum, value) => sum + (value - mean) ** 2, 0);
  return { mean, sigma: Math.sqrt(square / Math.max(values.length - 1, 1)) };
}

export class FlipMeasurement {
  private waiting: ((picture: Brightness) => void) | null = null;
  private steps_us: number[] = [];
  private before_us = Number.NaN;
  private stopped = false;

  constructor(
    private readonly patch: FlippingPatch,
    private readonly say: (line: string) => void,
    private readonly random: () => number = Math.random,
  ) {}

  /** Every picture, as it arrives. */
  picture(picture: Brightness): void {
    const step = picture.stamp_us - this.before_us;
    this.before_us = picture.stamp_us;
    if (step > 0) this.steps_us.push(step);
    this.waiting?.(picture);
    this.waiting = null;
  }

  stop(): void {
    this.stopped = true;
  }

  /** Throws an Error with one line for people. */
  async measure(flips: number): Promise<Result> {
    this.say('black, for reference');
    const black = await this.reference(false);
    this.say('white, for reference');
    const white = await this.reference(true);
    const contrast = white.mean - black.mean;
    if (contrast < Math.max(LEAST_CONTRAST, CLEARLY * (white.sigma + black.sigma))) {
      throw new Error(
        `the camera does not see the screen flip (${contrast.toFixed(1)} grey levels between black and white): ` +
        'point it at the screen so that this page fills its picture, and fix its exposure',
      );
    }
    return this.flipFor(flips, 0.5 * (black.mean + white.mean), contrast);
  }

  private async flipFor(flips: number, threshold: number, contrast: number): Promise<Result> {
    const delays: number[] = [];
    this.steps_us = [];
    let white = true;
    let missed = 0;
    while (delays.length + missed < flips && !this.stopped) {
      white = !white;
      const now = performance.now();
      const flipped = await this.patch.flip(white, now + this.random() * this.period_ms());
      const seen = await this.seen(white, threshold, flipped);
      if (seen === null) missed++;
      else delays.push((seen - flipped) / 1e3);
      this.say(`flip ${delays.length + missed} of ${flips}`);
      await this.next(); // may show half of the flip
    }
    if (delays.length < FEWEST_FLIPS) throw new Error(`only ${delays.length} flips were seen: give it more, or more light`);
    return this.result(delays, missed, contrast);
  }

  private result(delays: readonly number[], missed: number, contrast: number): Result {
    const { mean, sigma } = statistics(delays);
    const period = this.period_ms() / 1e3;
    const spread = statistics(this.steps_us.map((step) => step / 1e6)).sigma / Math.sqrt(Math.max(this.steps_us.length, 1));
    const error = sigma / Math.sqrt(delays.length);
    return {
      frame_rate_hz: { value: 1 / period, sigma: spread / (period * period) },
      round_trip_s: { value: mean, sigma: error },
      latency_s: { value: mean - period / 2, sigma: error },
      seen: delays.length,
      missed,
      contrast_counts: contrast,
    };
  }

  private async reference(white: boolean): Promise<Level> {
    const shown = await this.patch.flip(white, 0);
    const levels: number[] = [];
    for (;;) {
      const { level, arrived_ms } = await this.next();
      if (arrived_ms < shown + SETTLE_MS) continue;
      levels.push(level);
      if (arrived_ms > shown + SETTLE_MS + REFERENCE_MS && levels.length >= 5) return statistics(levels);
    }
  }

  private async seen(white: boolean, threshold: number, flipped_ms: number): Promise<number | null> {
    for (;;) {
      const { level, arrived_ms } = await this.next();
      if (arrived_ms > flipped_ms && level > threshold === white) return arrived_ms;
      if (arrived_ms > flipped_ms + LONGEST_MS) return null;
    }
  }

  private next(): Promise<Brightness> {
    return new Promise((done, failed) => {
      if (this.stopped) return failed(new Error('stopped'));
      const timer = setTimeout(() => failed(new Error('the camera delivers no pictures any more: replug it')), PATIENCE_MS);
      this.waiting = (picture) => {
        clearTimeout(timer);
        done(picture);
      };
    });
  }

  private period_ms(): number {
    const sorted = [...this.steps_us].sort((a, b) => a - b);
    return (sorted[sorted.length >> 1] ?? 40_000) / 1e3;
  }
}

export function reportText({ frame_rate_hz, round_trip_s, latency_s, seen, missed, contrast_counts }: Result): [string, string, string][] {
  const ms = ({ value, sigma }: Figure): string => `${(1e3 * value).toFixed(1)} ± ${(1e3 * sigma).toFixed(1)} ms`;
  return [
    ['round trip', ms(round_trip_s), 'mean, from a flip to the arrival of the picture that shows it'],
    ['latency', ms(latency_s), 'the same less half a picture: of screen, camera and browser together'],
    ['frame rate', `${frame_rate_hz.value.toFixed(2)} ± ${frame_rate_hz.sigma.toFixed(2)} Hz`, 'by the pictures\' time stamps'],
    ['flips', `${seen} seen, ${missed} missed`, `${contrast_counts.toFixed(0)} grey levels between black and white`],
  ];
}

/** The format of `tagwrench camera-timing --screen --json`. */
export function reportJson(result: Result, camera: string): string {
  const { frame_rate_hz, round_trip_s, latency_s, seen, missed, contrast_counts } = result;
  return JSON.stringify({
    format: 'tagwrench-screen-1', camera, screen: 'web page', frame_rate_hz, latency_s,
    round_trip_s: round_trip_s.value, flips: { seen, missed }, contrast_counts,
  }, null, 2);
}
