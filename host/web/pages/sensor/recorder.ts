// Samples into a CSV file with the columns of the bridge's, in memory that is bounded: text goes into blobs, which the browser may
// keep on disk, and a recording that has grown too long ends by itself.
import { CSV_HEADER, csvRow } from '../common/csv';
import type { Sample } from '../common/sample';

const ROWS_A_BLOB = 2000;
/** About 350 bytes a row: 9 hours at 60 Hz. */
export const MOST_ROWS = 2_000_000;

export class Recorder {
  rows = 0;
  running = false;
  private blobs: Blob[] = [];
  private lines: string[] = [];
  private from_ns = 0;
  private to_ns = 0;

  start(): void {
    this.blobs = [];
    this.lines = [`${CSV_HEADER}\n`];
    this.rows = 0;
    this.from_ns = this.to_ns = 0;
    this.running = true;
  }

  stop(): void {
    this.running = false;
  }

  add(sample: Sample): void {
    if (!this.running) return;
    if (this.rows === 0) this.from_ns = sample.t_ns;
    this.to_ns = sample.t_ns;
    this.lines.push(`${csvRow(sample)}\n`);
    if (++this.rows % ROWS_A_BLOB === 0) this.pack();
    if (this.rows >= MOST_ROWS) this.stop();
  }

  get full(): boolean {
    return this.rows >= MOST_ROWS;
  }

  get seconds(): number {
    return (this.to_ns - this.from_ns) / 1e9;
  }

  /** All of it so far. */
  file(): Blob {
    this.pack();
    return new Blob(this.blobs, { type: 'text/csv' });
  }

  private pack(): void {
    if (this.lines.length) this.blobs.push(new Blob(this.lines));
    this.lines = [];
  }
}
