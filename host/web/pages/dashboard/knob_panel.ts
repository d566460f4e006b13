// The sliders of a profile. A move is told at once; what the bridge makes of it comes back as another text.
import './knobs.css';
import { make, say } from '../common/elements';
import { type Choice, type Knob, type KnobGroup, type Slider, knobsOf, placeOf, valueAt } from './knobs';
import type { Path, ProfileText } from './profile_text';

type Value = number | string | boolean;
type Changes = readonly (readonly [Path, Value])[];

const SLIDER_STEPS = 400;

interface Control {
  /** Shows a knob of the same place; what is held just now stays under the hand. */
  show(knob: Knob): void;
}

export class KnobPanel {
  readonly element = make('div', { class: 'knobs' });
  private outline = '';
  private controls: Control[] = [];

  constructor(private readonly onMove: (changes: Changes) => void) {}

  show(text: ProfileText): void {
    const groups = knobsOf(text);
    const outline = JSON.stringify(groups.map((group) => group.knobs.map((knob) => [knob.label, knob.kind])));
    if (outline !== this.outline) {
      this.outline = outline;
      this.build(groups);
    }
    for (const [index, knob] of groups.flatMap((group) => group.knobs).entries())
      this.controls[index]?.show(knob);
  }

  /** Only when other knobs are there than before. */
  private build(groups: readonly KnobGroup[]): void {
    const held = document.activeElement?.id ?? '';
    this.controls = [];
    this.element.replaceChildren();
    for (const group of groups) {
      const set = make('fieldset', {}, make('legend', {}, group.title));
      for (const knob of group.knobs)
        set.append(knob.kind === 'slider' ? this.slider(knob) : this.choice(knob));
      this.element.append(set);
    }
    if (held.startsWith('knob-')) document.getElementById(held)?.focus();
  }

  private move(knob: Knob, value: Value): void {
    this.onMove(knob.paths.map((path) => [path, value] as const));
  }

  private slider(first: Slider): HTMLElement {
    let knob = first;
    const id = `knob-${knob.paths[0]?.join('-')}`;
    const input = make('input', { type: 'range', id, min: 0, max: SLIDER_STEPS, step: 1 });
    const shown = make('output', { class: 'number knob-value', for: id });
    const write = (): void => {
      const words = `${Number((knob.value / knob.scale).toPrecision(4))} ${knob.unit}`.trim();
      say(shown, words);
      input.setAttribute('aria-valuetext', words);
    };
    input.addEventListener('input', () => {
      knob = { ...knob, value: valueAt(knob, Number(input.value) / SLIDER_STEPS) };
      write();
      this.move(knob, knob.value);
    });
    this.controls.push({
      show: (now) => {
        if (now.kind !== 'slider') return;
        knob = now;
        const held = input.matches(':active');
        if (!held && valueAt(knob, Number(input.value) / SLIDER_STEPS) !== knob.value) {
          input.value = String(Math.round(placeOf(knob) * SLIDER_STEPS));
        }
        write();
      },
    });
    return make('div', { class: 'knob' }, make('label', { for: id }, knob.label), input, shown);
  }

  private choice(first: Choice): HTMLElement {
    let knob = first;
    const id = `knob-${knob.paths[0]?.join('-')}`;
    const select = make(
      'select',
      { id },
      ...knob.names.map((name, index) => make('option', { value: index }, name)),
    );
    select.addEventListener('change', () => {
      const value = knob.values[Number(select.value)];
      if (value !== undefined) this.move(knob, value);
    });
    this.controls.push({
      show: (now) => {
        if (now.kind !== 'choice') return;
        knob = now;
        select.value = String(Math.max(0, knob.values.indexOf(knob.value)));
      },
    });
    return make('div', { class: 'knob choice' }, make('label', { for: id }, knob.label), select);
  }
}
