// The last seconds of six values and their sigmas, in typed arrays that uPlot reads in place.
import { AXES, type Sample, carriesNumbers, wrenchOf } from './sample';

const LONGEST_GAP_S = 0.5;

export class TraceStore {
  /** Valid until the next push(). Times in s since the first sample. */
  times = new Float64Array();
  readonly values: Float64Array[] = AXES.map(() => new Float64Array());
  readonly sigmas: Float64Array[] = AXES.map(() => new Float64Array());

  private readonly room: Float64Array<ArrayBuffer>;
  private readonly columns: Float64Array<ArrayBuffer>[];
  private begin = 0;
  private end = 0;
  private epoch_ns = 0;

  /** `most` samples are kept. */
  constructor(private readonly most: number) {
    this.room = new Float64Array(2 * most);
    this.columns = Array.from({ length: 2 * AXES.length }, () => new Float64Array(2 * most));
  }

  get count(): number {
    return this.end - this.begin;
  }

  get newest(): number {
    return this.count > 0 ? (this.room[this.end - 1] ?? 0) : 0;
  }

  clear(): void {
    this.begin = this.end = 0;
    this.cut();
  }

  /** What has no numbers, and a pause, is a gap. A clock that goes back (another bridge) begins anew. */
  push(samples: readonly Sample[]): void {
    for (const sample of samples) {
      if (this.count === 0) this.epoch_ns = sample.t_ns;
      let time = (sample.t_ns - this.epoch_ns) / 1e9;
      if (this.count > 0 && time <= this.newest) {
        this.begin = this.end = 0;
        this.epoch_ns = sample.t_ns;
        time = 0;
      }
      if (this.count > 0 && time - this.newest > LONGEST_GAP_S) this.append((time + this.newest) / 2, null);
      this.append(time, carriesNumbers(sample.status) ? sample : null);
    }
    this.cut();
  }

  private append(time: number, sample: Sample | null): void {
    if (this.end === this.room.length) this.compact();
    this.room[this.end] = time;
    for (let axis = 0; axis < AXES.length; ++axis) {
      const scale = AXES[axis]?.scale ?? 1;
      this.put(axis, sample ? wrenchOf(sample, axis) * scale : Number.NaN);
      this.put(axis + AXES.length, sample ? (sample.w_sigma[axis] ?? 0) * scale : Number.NaN);
    }
    ++this.end;
    if (this.count > this.most) ++this.begin;
  }

  private put(column: number, value: number): void {
    const values = this.columns[column];
    if (values) values[this.end] = value;
  }

  private compact(): void {
    for (const column of [this.room, ...this.columns]) column.copyWithin(0, this.begin, this.end);
    this.end -= this.begin;
    this.begin = 0;
  }

  private cut(): void {
    this.times = this.room.subarray(this.begin, this.end);
    for (let axis = 0; axis < AXES.length; ++axis) {
      this.values[axis] = (this.columns[axis] ?? this.room).subarray(this.begin, this.end);
      this.sigmas[axis] = (this.columns[axis + AXES.length] ?? this.room).subarray(this.begin, this.end);
    }
  }
}
