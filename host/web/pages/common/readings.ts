// The six numbers with units, uncertainty and held peaks, a bar for each, and the zero.
import './readings.css';
import { button, make, say } from './elements';
import { AXES, type Axis, type Sample, ZERO_WORDS, carriesNumbers, figure, wrenchOf } from './sample';

export interface ReadingsOptions {
  /** Hands are off: what reads now is nothing from now on. */
  onZero: () => void;
  onPeakReset?: () => void;
}

interface Row {
  axis: Axis;
  bar: HTMLElement;
  value: HTMLElement;
  sigma: HTMLElement;
  peak: HTMLElement;
  /** SI, with its sign; 0 so far. */
  most: number;
  range: number;
}

const NUMBERS_EVERY_MS = 100;

export class Readings {
  readonly zeroButton: HTMLButtonElement;

  private readonly rows: Row[];
  private readonly zeroState: HTMLElement;
  private readonly sums: readonly HTMLElement[];
  private latest: Sample | null = null;
  private request = 0;
  private written_ms = Number.NEGATIVE_INFINITY;

  constructor(parent: HTMLElement, options: ReadingsOptions) {
    const table = make('table', { class: 'readings' });
    table.append(make('caption', { class: 'unseen' }, 'Forces and torques on the platform'), Readings.head());
    const body = make('tbody');
    this.rows = AXES.map((axis) => Readings.row(body, axis));
    table.append(body);
    this.sums = [make('span', { class: 'number' }), make('span', { class: 'number' })];
    const sums = make(
      'p',
      { class: 'sums' },
      '|F| ',
      this.sums[0] ?? '',
      ' N   |M| ',
      this.sums[1] ?? '',
      ' mN m',
    );
    this.zeroButton = button('Zero', options.onZero, {
      title: 'Hands off: what reads now is nothing from now on (key 0)',
    });
    this.zeroState = make('span', { class: 'zero-state', role: 'status', 'aria-live': 'polite' });
    const reset = button(
      'Reset peaks',
      () => {
        this.resetPeaks();
        options.onPeakReset?.();
      },
      { class: 'quiet' },
    );
    const zero = make('span', { class: 'zero-words' }, 'Zero: ', this.zeroState);
    parent.append(
      table,
      make('div', { class: 'row readings-sums' }, sums, reset),
      make('div', { class: 'row readings-actions' }, this.zeroButton, zero),
    );
    this.write();
  }

  /** Of every sample, so that no peak is missed; drawn when the browser draws. */
  show(sample: Sample): void {
    this.latest = sample;
    if (carriesNumbers(sample.status)) {
      for (const [index, row] of this.rows.entries()) {
        const value = wrenchOf(sample, index);
        if (Math.abs(value) > Math.abs(row.most)) row.most = value;
      }
    }
    if (this.request === 0) this.request = requestAnimationFrame((now) => this.draw(now));
  }

  /** Full scale in N and N m: a single number each, or one for every axis. */
  setRange(range_n: readonly number[], range_nm: readonly number[]): void {
    for (const [index, row] of this.rows.entries()) {
      const ranges = index < 3 ? range_n : range_nm;
      row.range = ranges[index % 3] ?? ranges[0] ?? 0;
    }
  }

  /** Nothing is measured now; peaks stay. */
  forget(): void {
    this.latest = null;
    for (const { bar } of this.rows) bar.style.transform = 'scaleX(0)';
    this.write();
  }

  resetPeaks(): void {
    for (const row of this.rows) row.most = 0;
    this.write();
  }

  private static head(): HTMLElement {
    const names = ['axis', 'of full scale', 'now', '', 'σ', 'peak'];
    const cells = names.map((name) =>
      make('th', { scope: 'col', class: name === 'of full scale' ? 'bar-head' : '' }, name),
    );
    return make('thead', {}, make('tr', {}, ...cells));
  }

  private static row(body: HTMLElement, axis: Axis): Row {
    const bar = make('i');
    const cell = (name: string): HTMLElement => make('td', { class: `number ${name}` });
    const row: Row = {
      axis,
      bar,
      value: cell('now'),
      sigma: cell('sigma'),
      peak: cell('peak'),
      most: 0,
      range: 0,
    };
    const name = make('th', { scope: 'row', title: axis.title }, axis.name);
    name.style.color = bar.style.background = `var(${axis.colour})`;
    const holder = make(
      'td',
      { class: 'bar-cell' },
      make('div', { class: 'bar two-sided', 'aria-hidden': true }, bar),
    );
    body.append(
      make('tr', {}, name, holder, row.value, make('td', { class: 'unit' }, axis.unit), row.sigma, row.peak),
    );
    return row;
  }

  private draw(now: number): void {
    this.request = 0;
    const sample = this.latest;
    if (!sample) return;
    const numbers = carriesNumbers(sample.status);
    for (const [index, row] of this.rows.entries()) {
      const part = numbers && row.range > 0 ? wrenchOf(sample, index) / row.range : 0;
      row.bar.style.transform = `scaleX(${Math.max(-1, Math.min(1, part)).toFixed(4)})`;
      row.bar.classList.toggle('beyond', Math.abs(part) > 1);
    }
    if (now - this.written_ms >= NUMBERS_EVERY_MS) {
      this.written_ms = now;
      this.write();
    } else {
      // A last sample must not stay unwritten.
      this.request = requestAnimationFrame((later) => this.draw(later));
    }
  }

  private write(): void {
    const sample = this.latest;
    const numbers = sample !== null && carriesNumbers(sample.status);
    for (const [index, row] of this.rows.entries()) {
      const { scale, decimals } = row.axis;
      say(row.value, numbers ? figure(wrenchOf(sample, index) * scale, decimals) : '–');
      say(
        row.sigma,
        numbers ? `±${figure((sample.w_sigma[index] ?? Number.NaN) * scale, decimals + 1)}` : '–',
      );
      say(row.peak, numbers || row.most !== 0 ? figure(row.most * scale, decimals) : '–');
    }
    const [force, torque] = this.sums;
    if (force) say(force, numbers ? Math.hypot(...sample.f_n).toFixed(3) : '–');
    if (torque) say(torque, numbers ? (Math.hypot(...sample.m_nm) * 1e3).toFixed(2) : '–');
    say(this.zeroState, sample?.zero_state ? ZERO_WORDS[sample.zero_state] : '–');
  }
}
