// What can be tuned of a profile: sliders, switches and choices, and where each
// stands in the text.
import { PROFILE_AXES, type Path, type ProfileText } from './profile_text';

export interface Slider {
  kind: 'slider';
  label: string;
  unit: string;
  /** Of one unit, in the profile's. */
  scale: number;
  /** In the profile's unit. */
  value: number;
  lowest: number;
  highest: number;
  /** Moves by ratio: what is felt by its ratio. */
  byRatio: boolean;
  paths: readonly Path[];
}

export interface Choice {
  kind: 'choice';
  label: string;
  names: readonly string[];
  /** As the text has them. */
  values: readonly (string | boolean)[];
  value: string | boolean;
  paths: readonly Path[];
}

export type Knob = Slider | Choice;

export interface KnobGroup {
  title: string;
  knobs: readonly Knob[];
}

function slider(
  text: ProfileText,
  label: string,
  path: Path,
  bounds: readonly [number, number],
  more: Partial<Slider> = {},
): Slider[] {
  const value = text.number(path, Number.NaN);
  if (Number.isNaN(value)) return [];
  const [lowest, highest] = [Math.min(bounds[0], value), Math.max(bounds[1], value)];
  return [
    {
      kind: 'slider',
      label,
      unit: '',
      scale: 1,
      value,
      lowest,
      highest,
      byRatio: lowest > 0,
      paths: [path],
      ...more,
    },
  ];
}

function choice(
  text: ProfileText,
  label: string,
  path: Path,
  values: readonly string[],
  names = values,
): Choice[] {
  return [{ kind: 'choice', label, names, values, value: text.text(path, values[0] ?? ''), paths: [path] }];
}

function toggle(text: ProfileText, label: string, path: Path): Choice[] {
  return [
    {
      kind: 'choice',
      label,
      names: ['off', 'on'],
      values: [false, true],
      value: text.flag(path, false),
      paths: [path],
    },
  ];
}

function feel(text: ProfileText): Knob[] {
  const shapes = PROFILE_AXES.map((axis) => text.shape(axis));
  const first = shapes[0];
  const alike = PROFILE_AXES.filter(
    (_, i) => shapes[i]?.curve.power === first?.curve.power && !shapes[i]?.curve.points,
  );
  const paths = alike.map((axis) => ['axes', axis, 'curve', 'power']);
  const power =
    first && !first.curve.points
      ? [{ ...sliderOf('curve, power', first.curve.power, 0.3, 4), byRatio: false, paths }]
      : [];
  return [
    ...slider(text, 'sensitivity, translation', ['translation'], [0.1, 10]),
    ...slider(text, 'sensitivity, rotation', ['rotation'], [0.1, 10]),
    ...power,
    ...toggle(text, 'one axis at a time', ['dominant', 'on']),
    ...(text.flag(['dominant', 'on'], false)
      ? slider(text, 'another takes over when stronger', ['dominant', 'ratio'], [1, 3], { byRatio: false })
      : []),
    ...choice(text, 'lock (stays zero)', ['lock'], ['none', 'translation', 'rotation']),
  ];
}

function sliderOf(label: string, value: number, lowest: number, highest: number): Slider {
  return {
    kind: 'slider',
    label,
    unit: '',
    scale: 1,
    value,
    lowest: Math.min(lowest, value),
    highest: Math.max(highest, value),
    byRatio: true,
    paths: [],
  };
}

function smoothing(text: ProfileText): Knob[] {
  const kind = text.text(['filter', 'kind'], 'none');
  const numbers: Readonly<Record<string, readonly Knob[]>> = {
    one_euro: [
      ...slider(text, 'cut-off of a still hand', ['filter', 'cutoff_hz'], [0.1, 50], { unit: 'Hz' }),
      ...slider(text, 'more for each full scale/s', ['filter', 'hz_per_speed'], [0.1, 200], { unit: 'Hz' }),
    ],
    exponential: slider(text, 'weight of the newest', ['filter', 'weight'], [0.01, 1]),
  };
  return [
    ...choice(
      text,
      'filter',
      ['filter', 'kind'],
      ['none', 'exponential', 'one_euro'],
      ['none', 'exponential', 'one euro'],
    ),
    ...(numbers[kind] ?? []),
  ];
}

function perAxis(text: ProfileText, what: 'full' | 'dead' | 'invert'): Knob[] {
  return PROFILE_AXES.flatMap((axis): Knob[] => {
    if (what === 'invert') return toggle(text, `invert ${axis}`, ['axes', axis, 'invert']);
    const { source, full, dead } = text.shape(axis);
    const force = source < 3;
    const unit = force ? { unit: 'N', scale: 1 } : { unit: 'mN m', scale: 1e-3 };
    const name = force ? 'n' : 'nm';
    const one = force ? 1 : 0.02;
    if (what === 'full')
      return slider(
        text,
        axis,
        ['axes', axis, `full_scale_${name}`],
        [Math.max(0.05 * one, 1.2 * dead), 20 * one],
        unit,
      );
    return slider(text, axis, ['axes', axis, `dead_zone_${name}`], [0, 0.5 * full], {
      ...unit,
      byRatio: false,
    });
  });
}

function gestures(text: ProfileText): Knob[] {
  return [
    ...slider(text, 'tap, least force', ['gestures', 'tap_force_n'], [0.05, 20], { unit: 'N' }),
    ...slider(text, 'press-hold, least force', ['gestures', 'press_force_n'], [0.05, 20], { unit: 'N' }),
    ...slider(text, 'twist-click, least torque', ['gestures', 'twist_torque_nm'], [1e-4, 0.4], {
      unit: 'mN m',
      scale: 1e-3,
    }),
    ...slider(text, 'press-hold, for', ['gestures', 'press_ms'], [200, 2000], { unit: 'ms', byRatio: false }),
  ];
}

export function knobsOf(text: ProfileText): KnobGroup[] {
  return [
    { title: 'Feel', knobs: feel(text) },
    { title: 'Smoothing', knobs: smoothing(text) },
    { title: 'Full scale (push of full deflection)', knobs: perAxis(text, 'full') },
    { title: 'Dead zone (push that is still rest)', knobs: perAxis(text, 'dead') },
    { title: 'Directions', knobs: perAxis(text, 'invert') },
    { title: 'Gestures', knobs: gestures(text) },
  ].filter((group) => group.knobs.length > 0);
}

/** 0..1 along the slider, and back. Three digits are more than a hand feels. */
export function placeOf(knob: Slider): number {
  if (knob.highest <= knob.lowest) return 0;
  return knob.byRatio
    ? Math.log(knob.value / knob.lowest) / Math.log(knob.highest / knob.lowest)
    : (knob.value - knob.lowest) / (knob.highest - knob.lowest);
}

export function valueAt(knob: Slider, place: number): number {
  const value = knob.byRatio
    ? knob.lowest * (knob.highest / knob.lowest) ** place
    : knob.lowest + place * (knob.highest - knob.lowest);
  const rounded = Number(value.toPrecision(3));
  const whole = knob.unit === 'ms' ? Math.round(rounded) : rounded;
  return Math.max(knob.lowest, Math.min(knob.highest, whole));
}
