// How much of what a calibration needs has been seen: a map of the picture, bars for the axes, or ranges of
// motion.
import { make, present, say } from '../common/elements';
import { AXES, figure } from '../common/sample';
import type { Coverage } from './protocol';

const REGIONS = [
  'top left',
  'top',
  'top right',
  'left',
  'middle',
  'right',
  'bottom left',
  'bottom',
  'bottom right',
];
const MOTIONS = ['x', 'y', 'z', 'about x', 'about y', 'about z'];
/** Views of a region that are plenty, for its shade. */
const PLENTY = 6;
/** Ranges that fill a bar: 1 mm (z: 0.5 mm) and 50 mrad. */
const FULL_MOTION = [1e-3, 1e-3, 5e-4, 0.05, 0.05, 0.05];

export class CoverageView {
  readonly element = make('div', { class: 'coverage', hidden: true });
  private readonly map = make('div', { class: 'coverage-map', role: 'img' });
  private readonly bars = make('div', { class: 'coverage-bars' });
  private readonly words = make('p', { class: 'hint' });

  constructor() {
    this.element.append(this.map, this.bars, this.words);
  }

  show(coverage: Coverage | null): void {
    present(this.element, coverage !== null);
    if (!coverage) return;
    present(this.map, coverage.regions !== undefined);
    present(this.bars, coverage.axes !== undefined || coverage.range !== undefined);
    if (coverage.regions) this.showMap(coverage.regions);
    if (coverage.axes)
      this.showBars(
        coverage.axes.map((part, i) => [
          AXES[i]?.name ?? '',
          part,
          `${figure(part * 100, 0)} %`,
          AXES[i]?.colour ?? '',
        ]),
      );
    if (coverage.range) {
      this.showBars(
        coverage.range.map((range, i) => {
          const words = i < 3 ? `${figure(range * 1e3, 2)} mm` : `${figure(range * 1e3, 1)} mrad`;
          return [MOTIONS[i] ?? '', range / (FULL_MOTION[i] ?? 1), words, AXES[i]?.colour ?? ''];
        }),
      );
    }
    say(this.words, CoverageView.sentence(coverage));
  }

  private static sentence(coverage: Coverage): string {
    const seen = coverage.views ?? coverage.keyframes;
    const of = coverage.wanted === undefined ? '' : ` (${coverage.wanted} needed)`;
    const count =
      seen === undefined ? '' : `${seen} ${coverage.views === undefined ? 'key frames' : 'views'}${of}`;
    const missing =
      coverage.missing && coverage.missing.length > 0 ? `still missing: ${coverage.missing.join(', ')}` : '';
    return [count, missing].filter((part) => part !== '').join('; ');
  }

  private showMap(regions: readonly number[]): void {
    if (this.map.childElementCount !== REGIONS.length)
      this.map.replaceChildren(...REGIONS.map(() => make('span', { class: 'number' })));
    for (const [index, cell] of [...this.map.children].entries()) {
      const views = regions[index] ?? 0;
      say(cell, String(views));
      (cell as HTMLElement).style.setProperty('--part', String(Math.min(1, views / PLENTY)));
      cell.classList.toggle('none', views === 0);
    }
    this.map.setAttribute(
      'aria-label',
      `Views in each part of the picture: ${REGIONS.map((name, i) => `${name} ${regions[i] ?? 0}`).join(', ')}`,
    );
  }

  private showBars(rows: readonly (readonly [string, number, string, string])[]): void {
    if (this.bars.childElementCount !== rows.length) {
      this.bars.replaceChildren(
        ...rows.map(() =>
          make(
            'div',
            { class: 'gauge coverage-row' },
            make('span', {}),
            make('div', { class: 'bar', 'aria-hidden': true }, make('i')),
            make('span', { class: 'number gauge-value' }),
          ),
        ),
      );
    }
    for (const [index, [name, part, words, colour]] of rows.entries()) {
      const [label, bar, value] = this.bars.children[index]?.children ?? [];
      if (!label || !bar || !value) continue;
      say(label, name);
      say(value, words);
      const fill = bar.firstElementChild as HTMLElement;
      fill.style.transform = `scaleX(${Math.max(0, Math.min(1, part)).toFixed(3)})`;
      fill.style.background = `var(${colour})`;
    }
  }
}
