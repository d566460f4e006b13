// Six traces one above the other, with bands of two standard deviations, over a time axis that they share.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import './traces.css';
import { make, say } from './elements';
import { AXES, type Axis, type Sample, figure } from './sample';
import { colour, onTheme, translucent } from './theme';
import { TraceStore } from './trace_store';

export interface TracesOptions {
  /** Shown; 20 unless said. */
  seconds?: number;
}

interface Trace {
  axis: Axis;
  holder: HTMLElement;
  readout: HTMLElement;
  stroke: string;
  band: string;
  /** Full scale, in the axis' unit; 0: not known. */
  range: number;
  /** The axis reaches from -limit to limit. */
  limit: number;
}

const MOST_HZ = 250;
const BAND_SIGMAS = 2;
const Y_AXIS_PX = 52;
const X_AXIS_PX = 24;
const FURTHEST_AHEAD_S = 0.25;

/** 1, 2 or 5 times a power of ten, at least `value`. */
function niceAbove(value: number): number {
  const decade = 10 ** Math.floor(Math.log10(Math.max(value, 1e-9)));
  return ([1, 2, 5, 10].find((step) => step * decade >= value * 0.999999) ?? 10) * decade;
}

/** 0.25, 10, −2.5: as many decimals as it takes. */
function shortest(value: number): string {
  const decimals =
    [0, 1, 2, 3, 4].find((d) => Math.abs(Number(value.toFixed(d)) - value) <= 1e-9 * Math.abs(value)) ?? 5;
  return figure(value, decimals);
}

export class Traces {
  private readonly seconds: number;
  private readonly store: TraceStore;
  private readonly traces: Trace[];
  private readonly plots: uPlot[];
  private readonly calm = matchMedia('(prefers-reduced-motion: reduce)');
  private readonly parent: HTMLElement;
  private grid = '';
  private ink = '';
  private paused = false;
  private visible = false;
  private stale = true;
  private request = 0;
  /** Clock of the page minus that of the samples, s, of the one that was least late. */
  private lead = Number.NaN;
  private edge = 0;

  constructor(parent: HTMLElement, options: TracesOptions = {}) {
    this.seconds = options.seconds ?? 20;
    this.store = new TraceStore(Math.ceil((this.seconds + 2) * MOST_HZ));
    this.parent = make('div', {
      class: 'traces',
      role: 'group',
      'aria-label': `Traces of the last ${this.seconds} seconds`,
    });
    parent.append(this.parent);
    this.traces = AXES.map((axis, index) => this.makeTrace(axis, index));
    this.plots = this.traces.map((trace, index) => this.makePlot(trace, index));
    onTheme(() => this.recolour());
    new ResizeObserver(() => this.fit()).observe(this.parent);
    new IntersectionObserver((seen) => this.see(seen.some((entry) => entry.isIntersecting))).observe(
      this.parent,
    );
  }

  push(samples: readonly Sample[]): void {
    if (samples.length === 0 || this.paused) return;
    const before = this.store.newest;
    this.store.push(samples);
    const lead = performance.now() / 1e3 - this.store.newest;
    if (this.store.newest < before || !(Math.abs(lead - this.lead) < 1)) {
      this.lead = lead;
      this.edge = 0;
    } else {
      // The least late sample tells best; slowly forgotten, since clocks differ.
      this.lead = Math.min(lead, this.lead + 0.002);
    }
    this.invalidate();
  }

  /** Full scale in N and N m: a single number each, or one for every axis. */
  setRange(range_n: readonly number[], range_nm: readonly number[]): void {
    for (const [index, trace] of this.traces.entries()) {
      const ranges = index < 3 ? range_n : range_nm;
      trace.range = (ranges[index % 3] ?? ranges[0] ?? 0) * trace.axis.scale;
    }
    this.invalidate();
  }

  pause(on: boolean): void {
    this.paused = on;
    this.parent.classList.toggle('paused', on);
    if (!on) this.lead = Number.NaN;
    this.invalidate();
  }

  clear(): void {
    this.store.clear();
    this.edge = 0;
    this.invalidate();
  }

  private makeTrace(axis: Axis, index: number): Trace {
    const last = index === AXES.length - 1;
    const readout = make('output', { class: 'trace-readout', 'aria-hidden': true });
    const name = make('div', { class: 'trace-name' }, make('b', {}, axis.name), ` ${axis.unit} `, readout);
    const holder = make('div', {
      class: last ? 'trace last' : 'trace',
      role: 'img',
      'aria-label': `${axis.title} over time, ${axis.unit}`,
    });
    holder.append(name);
    this.parent.append(holder);
    return { axis, holder, readout, stroke: '#000', band: '#000', range: 0, limit: 1e-3 };
  }

  private makePlot(trace: Trace, index: number): uPlot {
    const options = this.plotOptions(trace, index, index === AXES.length - 1);
    return new uPlot(options, [new Float64Array(), new Float64Array()], trace.holder);
  }

  private plotOptions(trace: Trace, index: number, last: boolean): uPlot.Options {
    const ink = (): string => this.ink;
    const grid = { stroke: () => this.grid, width: 1 };
    const ticks = { show: false };
    return {
      width: 300,
      height: 80,
      padding: [6, 10, last ? 0 : 6, 0],
      legend: { show: false },
      cursor: {
        y: false,
        drag: { setScale: false, x: false, y: false },
        points: { show: false },
        sync: { key: 'traces' },
      },
      select: { show: false, left: 0, top: 0, width: 0, height: 0 },
      scales: {
        x: { time: false, auto: false, range: (_plot, from, to) => [from, to] },
        y: { auto: false, range: () => [-trace.limit, trace.limit] },
      },
      axes: [
        {
          show: last,
          size: X_AXIS_PX,
          stroke: ink,
          grid,
          ticks,
          gap: 4,
          space: 60,
          values: (_plot, splits) => splits.map((s) => `${figure(s - this.edge, 0)} s`),
          splits: (_plot, _axis, from, to) => this.timeSplits(from, to),
        },
        {
          size: Y_AXIS_PX,
          stroke: ink,
          grid,
          ticks,
          gap: 4,
          splits: () => [-trace.limit, -trace.limit / 2, 0, trace.limit / 2, trace.limit],
          values: (_plot, splits) => splits.map((v) => (Math.abs(v) === trace.limit ? '' : shortest(v))),
        },
      ],
      series: [
        {},
        {
          stroke: () => trace.stroke,
          width: 1.5,
          points: { show: false },
          paths: (plot, _series, from, to) => this.line(plot, from, to),
        },
      ],
      hooks: {
        drawAxes: [(plot) => this.drawBand(plot, trace, index)],
        setCursor: [(plot) => this.showCursor(plot, trace)],
      },
    };
  }

  private timeSplits(from: number, to: number): number[] {
    const splits: number[] = [];
    const step = this.seconds > 12 ? 5 : 2;
    for (let back = 0; this.edge - back >= from - 1e-9; back += step) splits.unshift(this.edge - back);
    return splits.filter((s) => s <= to + 1e-9);
  }

  /** Canvas pixels of what lies between two indices; NaN breaks the line. */
  private line(plot: uPlot, from: number, to: number): uPlot.Series.Paths {
    const stroke = new Path2D();
    const times = plot.data[0] as Float64Array;
    const values = plot.data[1] as Float64Array;
    const { xAt, yAt } = this.toPixels(plot);
    let open = false;
    for (let i = from; i <= to; ++i) {
      const value = values[i] ?? Number.NaN;
      if (Number.isNaN(value)) {
        open = false;
        continue;
      }
      const x = xAt(times[i] ?? 0);
      if (open) stroke.lineTo(x, yAt(value));
      else stroke.moveTo(x, yAt(value));
      open = true;
    }
    return { stroke, fill: null, clip: null, band: null, gaps: [], flags: 0 };
  }

  private drawBand(plot: uPlot, trace: Trace, index: number): void {
    const { times, values, sigmas } = this.store;
    const value = values[index];
    const sigma = sigmas[index];
    if (!value || !sigma || times.length === 0) return;
    const { xAt, yAt } = this.toPixels(plot);
    const { left, top, width, height } = plot.bbox;
    const band = new Path2D();
    const begin = Math.max(0, this.firstShown(times));
    for (let i = begin; i < times.length; ++i) {
      if (Number.isNaN(value[i] ?? Number.NaN)) continue;
      let end = i;
      while (end + 1 < times.length && !Number.isNaN(value[end + 1] ?? Number.NaN)) ++end;
      // A new piece: a line would come from where the last one was closed.
      band.moveTo(xAt(times[i] ?? 0), yAt(value[i] ?? 0));
      for (let k = i; k <= end; ++k)
        band.lineTo(xAt(times[k] ?? 0), yAt((value[k] ?? 0) + BAND_SIGMAS * (sigma[k] ?? 0)));
      for (let k = end; k >= i; --k)
        band.lineTo(xAt(times[k] ?? 0), yAt((value[k] ?? 0) - BAND_SIGMAS * (sigma[k] ?? 0)));
      band.closePath();
      i = end;
    }
    const context = plot.ctx;
    context.save();
    context.beginPath();
    context.rect(left, top, width, height);
    context.clip();
    context.fillStyle = trace.band;
    context.fill(band);
    context.restore();
  }

  private toPixels(plot: uPlot): { xAt: (t: number) => number; yAt: (v: number) => number } {
    const { left, top, width, height } = plot.bbox;
    const { min: x0 = 0, max: x1 = 1 } = plot.scales.x ?? {};
    const { min: y0 = -1, max: y1 = 1 } = plot.scales.y ?? {};
    const perSecond = width / (x1 - x0);
    const perUnit = height / (y1 - y0);
    return { xAt: (t) => left + (t - x0) * perSecond, yAt: (v) => top + (y1 - v) * perUnit };
  }

  private firstShown(times: Float64Array): number {
    const from = this.edge - this.seconds;
    let low = 0;
    let high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((times[middle] ?? 0) < from) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  private showCursor(plot: uPlot, trace: Trace): void {
    const index = plot.cursor.idx;
    const value = index == null ? null : plot.data[1]?.[index];
    const time = index == null ? null : plot.data[0][index];
    const known = value != null && time != null && (plot.cursor.left ?? -1) >= 0;
    say(
      trace.readout,
      known ? `${figure(value, trace.axis.decimals)} at ${figure(time - this.edge, 2)} s` : '',
    );
  }

  private recolour(): void {
    this.grid = colour('--grid');
    this.ink = colour('--ink-faint');
    for (const trace of this.traces) {
      trace.stroke = colour(trace.axis.colour);
      trace.band = translucent(trace.stroke, 0.25);
      trace.holder.style.setProperty('--trace', trace.stroke);
    }
    this.invalidate();
  }

  private fit(): void {
    for (const [index, plot] of this.plots.entries()) {
      const { clientWidth: width = 0, clientHeight: height = 0 } = this.traces[index]?.holder ?? {};
      if (width > 0 && height > 0 && (width !== plot.width || height !== plot.height))
        plot.setSize({ width, height });
    }
    this.invalidate();
  }

  private see(visible: boolean): void {
    this.visible = visible;
    if (visible) this.fit();
  }

  private invalidate(): void {
    this.stale = true;
    if (this.visible && this.request === 0) this.request = requestAnimationFrame(() => this.frame());
  }

  private frame(): void {
    this.request = 0;
    if (!this.visible) return;
    const moves = this.advance();
    if (this.stale || moves) this.draw();
    this.stale = false;
    if (moves) this.request = requestAnimationFrame(() => this.frame());
  }

  /** Moves the right edge with the clock, between messages too; false: nothing is coming. */
  private advance(): boolean {
    const { newest } = this.store;
    const flowing = !this.paused && !this.calm.matches && this.store.count > 0;
    const clock = performance.now() / 1e3 - this.lead;
    const ahead = clock - newest;
    if (!flowing || !(ahead < FURTHEST_AHEAD_S)) {
      this.edge = Math.max(this.edge, newest);
      return false;
    }
    this.edge = Math.max(this.edge, Math.min(clock, newest + FURTHEST_AHEAD_S));
    return true;
  }

  private draw(): void {
    const { times, values } = this.store;
    const x = { min: this.edge - this.seconds, max: this.edge };
    for (const [index, trace] of this.traces.entries()) {
      this.rescale(trace, index);
      const plot = this.plots[index];
      plot?.batch(() => {
        plot.setData([times, values[index] ?? times], false);
        plot.setScale('x', x);
        plot.setScale('y', { min: -trace.limit, max: trace.limit });
      });
    }
  }

  /** Grows at once, shrinks only when less than a third is used. */
  private rescale(trace: Trace, index: number): void {
    const value = this.store.values[index];
    const sigma = this.store.sigmas[index];
    const least = trace.range > 0 ? trace.range / 20 : 0.01 * trace.axis.scale ** 0.5;
    let most = least;
    if (value && sigma) {
      for (let i = Math.max(0, this.firstShown(this.store.times)); i < value.length; ++i) {
        const size = Math.abs(value[i] ?? 0) + BAND_SIGMAS * (sigma[i] ?? 0);
        if (size > most) most = size;
      }
    }
    if (most > trace.limit || most < trace.limit / 3) trace.limit = niceAbove(most * 1.05);
  }
}
