// Bars for what the picture is worth: sharpness, light, residual; each with a word on what to do.
import { make, say } from '../common/elements';
import { figure } from '../common/sample';
import type { BridgeState } from './protocol';

type Judgement = readonly ['good' | 'warn' | 'bad', string];

interface Gauge {
  name: string;
  unit: string;
  full: number;
  decimals: number;
  judge: (value: number) => Judgement;
}

const GAUGES: Readonly<Record<'edge' | 'white' | 'clipped' | 'residual', Gauge>> = {
  edge: {
    name: 'Edge width',
    unit: 'px',
    full: 4,
    decimals: 2,
    judge: (px) =>
      px <= 2
        ? ['good', 'sharp']
        : px <= 3
          ? ['warn', 'soft: focus the lens']
          : ['bad', 'blurred: focus the lens'],
  },
  white: {
    name: 'White',
    unit: 'of 255',
    full: 255,
    decimals: 0,
    judge: (white) =>
      white < 80
        ? ['bad', 'dark: more light']
        : white < 120
          ? ['warn', 'rather dark']
          : white > 250
            ? ['warn', 'less light']
            : ['good', 'fine'],
  },
  clipped: {
    name: 'Clipped',
    unit: '%',
    full: 5,
    decimals: 1,
    judge: (percent) =>
      percent < 0.5 ? ['good', 'none'] : percent < 2 ? ['warn', 'less light'] : ['bad', 'less light'],
  },
  residual: {
    name: 'Residual',
    unit: '%',
    full: 10,
    decimals: 1,
    judge: (percent) =>
      percent < 4 ? ['good', 'fits'] : percent < 7 ? ['warn', 'dirt, shadow?'] : ['bad', 'run check'],
  },
};

class GaugeRow {
  readonly element: HTMLElement;
  private readonly bar = make('i');
  private readonly value = make('span', { class: 'number gauge-value' }, '–');
  private readonly word = make('span', { class: 'gauge-word' });

  constructor(private readonly gauge: Gauge) {
    const bar = make('div', { class: 'bar', 'aria-hidden': true }, this.bar);
    this.element = make(
      'div',
      { class: 'gauge' },
      make('span', { class: 'gauge-name' }, gauge.name),
      bar,
      this.value,
      this.word,
    );
  }

  show(value: number | null): void {
    const { full, decimals, unit, judge } = this.gauge;
    this.bar.style.transform = `scaleX(${value === null ? 0 : Math.max(0, Math.min(1, value / full))})`;
    const [level, word] = value === null ? (['good', ''] as const) : judge(value);
    this.bar.className = level;
    this.word.className = `gauge-word ${level}`;
    say(this.value, value === null ? '–' : `${figure(value, decimals)} ${unit}`);
    say(this.word, word);
  }
}

export class Quality {
  readonly element = make('div', { class: 'gauges' });
  private readonly edge = new GaugeRow(GAUGES.edge);
  private readonly white = new GaugeRow(GAUGES.white);
  private readonly clipped = new GaugeRow(GAUGES.clipped);
  private readonly residual = new GaugeRow(GAUGES.residual);

  constructor() {
    for (const row of [this.edge, this.white, this.clipped, this.residual]) this.element.append(row.element);
  }

  show(image: BridgeState['image']): void {
    const widest =
      image && image.edges_px.length > 0 ? Math.max(...image.edges_px.map((edge) => edge.px)) : null;
    this.edge.show(widest);
    this.white.show(image?.white ?? null);
    this.clipped.show(image ? image.clipped_part * 100 : null);
    this.residual.show(image ? image.residual_part * 100 : null);
  }
}
