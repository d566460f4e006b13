// Deflection against push of one axis of the device: the curve, the dead zone, and where the hand is now.
import { drawing, make, say } from '../common/elements';
import { AXES, figure } from '../common/sample';
import type { AxisShape } from './profile_text';
import { deflection } from './response';

const WIDTH = 200;
const HEIGHT = 130;
const LEFT = 30;
const BOTTOM = 18;
const TOP = 8;
const RIGHT = 8;
const STEPS = 120;
/** Of full scale; a little is shown beyond. */
const SHOWN = 1.1;

export class CurvePlot {
  readonly element: HTMLElement;

  private readonly dead = drawing('rect', { class: 'dead', y: TOP, height: HEIGHT - TOP - BOTTOM });
  private readonly out = drawing('path', { class: 'way-out' });
  private readonly back = drawing('path', { class: 'way-back' });
  private readonly dot = drawing('circle', { class: 'now', r: 4.5 });
  private readonly ends: readonly SVGTextElement[];
  private readonly title = make('figcaption');
  private readonly now = make('span', { class: 'number now-words' });
  private readonly picture: SVGSVGElement;
  private shape: AxisShape | null = null;

  constructor() {
    const [middle, base] = [this.y(0), HEIGHT - 5];
    this.ends = [-1, 0, 1].map((part) =>
      drawing('text', { x: this.x(part), y: base, class: 'tick', 'text-anchor': 'middle' }),
    );
    const ticks = [-1, 0, 1].map((v) =>
      drawing('text', { x: LEFT - 5, y: this.y(v) + 4, class: 'tick', 'text-anchor': 'end' }, figure(v, 0)),
    );
    const frame = [
      drawing('rect', {
        class: 'frame',
        x: LEFT,
        y: TOP,
        width: WIDTH - LEFT - RIGHT,
        height: HEIGHT - TOP - BOTTOM,
      }),
      this.dead,
      drawing('line', { class: 'axis', x1: LEFT, x2: WIDTH - RIGHT, y1: middle, y2: middle }),
      drawing('line', { class: 'axis', x1: this.x(0), x2: this.x(0), y1: TOP, y2: HEIGHT - BOTTOM }),
    ];
    this.picture = drawing(
      'svg',
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: 'img', class: 'curve' },
      ...frame,
      this.back,
      this.out,
      this.dot,
      ...ticks,
      ...this.ends,
    );
    const head = make('div', { class: 'curve-head' }, this.title, this.now);
    this.element = make('figure', { class: 'curve-plot' }, head, this.picture);
  }

  draw(shape: AxisShape): void {
    this.shape = shape;
    const fed = AXES[shape.source] ?? AXES[0];
    const { unit = 'N', scale = 1, colour = '--ink' } = fed ?? {};
    this.picture.style.setProperty('--curve', `var(${colour})`);
    say(this.title, shape.axis);
    const words = `${shape.axis}: full at ${figure(shape.full * scale, 3)} ${unit}, rest within ${figure(shape.dead * scale, 3)} ${unit}`;
    this.picture.setAttribute('aria-label', words);
    for (const [index, end] of this.ends.entries())
      say(end, index === 1 ? '0' : figure((index - 1) * shape.full * scale, scale > 1 ? 1 : 2));
    const half = Math.min(SHOWN, shape.dead / shape.full);
    this.dead.setAttribute('x', String(this.x(-half)));
    this.dead.setAttribute('width', String(this.x(half) - this.x(-half)));
    this.out.setAttribute('d', this.path(shape, false));
    this.back.setAttribute('d', this.path(shape, true));
  }

  /** `push` in N or N m as the axis takes it; NaN: it is not known. */
  show(push: number, motion: number): void {
    if (!this.shape) return;
    const { full, source } = this.shape;
    const part = Math.max(-SHOWN, Math.min(SHOWN, push / full));
    const known = Number.isFinite(part) && Number.isFinite(motion);
    this.dot.style.visibility = known ? 'visible' : 'hidden';
    if (known)
      this.dot.style.transform = `translate(${this.x(part).toFixed(2)}px, ${this.y(motion).toFixed(2)}px)`;
    const fed = AXES[source];
    say(
      this.now,
      known && fed
        ? `${figure(push * fed.scale, fed.decimals)} ${fed.unit} \u2192 ${figure(motion, 2)}`
        : '–',
    );
  }

  private x(part: number): number {
    return LEFT + ((part / SHOWN + 1) / 2) * (WIDTH - LEFT - RIGHT);
  }

  private y(value: number): number {
    return TOP + ((1 - value) / 2) * (HEIGHT - TOP - BOTTOM);
  }

  private path(shape: AxisShape, back: boolean): string {
    const points: string[] = [];
    for (let i = -STEPS; i <= STEPS; ++i) {
      const part = (i / STEPS) * SHOWN;
      points.push(
        `${this.x(part).toFixed(1)} ${this.y(deflection(shape, part * shape.full, back)).toFixed(1)}`,
      );
    }
    return `M${points.join('L')}`;
  }
}
