// Rate, losses and latency of the pictures, from their own time stamps and the clock of the worker.

const WINDOW = 120;
const LONGEST_GAP = 1.6;

function median(values: readonly number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[sorted.length >> 1] ?? 0;
}

/** The last second or so of a figure. */
class Recent {
  private values: number[] = [];

  add(value: number): void {
    this.values.push(value);
    if (this.values.length > WINDOW) this.values.shift();
  }
  get count(): number {
    return this.values.length;
  }
  median(): number {
    return median(this.values);
  }
}

export class FeedFigures {
  dropped = 0;
  private readonly steps = new Recent();
  private readonly tracking = new Recent();
  private readonly latency = new Recent();
  private before_us = Number.NaN;
  /** Page's clock less the camera's, ms, of the picture that came soonest: the two clocks have no common start. */
  private offset_ms = Number.POSITIVE_INFINITY;
  private period_us = 0;

  /** A picture was handed over; returns how many the camera made in between that never came. */
  arrived(time_us: number, now_ms: number): number {
    this.offset_ms = Math.min(this.offset_ms, now_ms - time_us / 1e3);
    const step = time_us - this.before_us;
    this.before_us = time_us;
    if (!(step > 0)) return 0;
    let lost = 0;
    if (this.steps.count >= 10 && step > LONGEST_GAP * this.period_us) {
      lost = Math.min(Math.round(step / this.period_us) - 1, 1e6);
    } else {
      this.steps.add(step);
      this.period_us = this.steps.median();
    }
    this.dropped += lost;
    return lost;
  }

  /** Its result is there; returns its latency in us. */
  tracked(time_us: number, begun_ms: number, now_ms: number): number {
    const late_ms = now_ms - time_us / 1e3 - this.offset_ms;
    this.tracking.add(now_ms - begun_ms);
    this.latency.add(late_ms);
    return Math.round(1e3 * late_ms);
  }

  get rate_hz(): number {
    return this.period_us > 0 ? 1e6 / this.period_us : 0;
  }
  get track_ms(): number {
    return this.tracking.median();
  }
  get latency_ms(): number {
    return this.latency.median();
  }
}
