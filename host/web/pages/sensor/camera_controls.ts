// Exposure, white balance, focus and what else a browser lets a page set of a camera: sliders, and one switch that holds all of it
// still. A tracker wants one and the same picture of one and the same thing; automatics spoil that.
import { button, field, make, say } from '../common/elements';

interface Range {
  min: number;
  max: number;
  step: number;
}

interface Setting {
  /** Name among the track's capabilities, settings and constraints. */
  key: string;
  /** Which of them is 'continuous' or 'manual'; none: the value is set as it is. */
  mode?: string;
  label: string;
  unit: string;
}

/** Order as people need them. The units are those of the W3C's Image Capture. */
const SETTINGS: readonly Setting[] = [
  { key: 'exposureTime', mode: 'exposureMode', label: 'Exposure', unit: '× 0.1 ms' },
  { key: 'iso', label: 'Gain', unit: 'ISO' },
  { key: 'focusDistance', mode: 'focusMode', label: 'Focus', unit: '' },
  { key: 'colorTemperature', mode: 'whiteBalanceMode', label: 'White balance', unit: 'K' },
  { key: 'brightness', label: 'Brightness', unit: '' },
  { key: 'contrast', label: 'Contrast', unit: '' },
  { key: 'zoom', label: 'Zoom', unit: '×' },
];
const MODES: readonly [string, string][] = [
  ['exposureMode', 'exposure'], ['whiteBalanceMode', 'white balance'], ['focusMode', 'focus'],
];

type Bag = Readonly<Record<string, unknown>>;

function rangeOf(value: unknown): Range | null {
  const { min, max, step } = (value ?? {}) as Partial<Range>;
  return typeof min === 'number' && typeof max === 'number' && max > min ? { min, max, step: step || (max - min) / 100 } : null;
}

export class CameraControls {
  private readonly words = make('p', { class: 'hint', role: 'status' });
  private readonly sliders = make('div', { class: 'fields' });
  private readonly hold: HTMLButtonElement;
  private track: MediaStreamTrack | null = null;
  private capabilities: Bag = {};

  constructor(parent: HTMLElement) {
    this.hold = button('Hold exposure and focus', () => void this.toggle(), { 'aria-pressed': 'false' });
    parent.append(make('div', { class: 'row' }, this.hold), this.words, this.sliders);
    this.use(null);
  }

  use(track: MediaStreamTrack | null): void {
    this.track = track;
    this.capabilities = (track?.getCapabilities?.() ?? {}) as Bag;
    this.show();
  }

  private get holdable(): [string, string][] {
    return MODES.filter(([mode]) => {
      const choices = this.capabilities[mode];
      return Array.isArray(choices) && choices.includes('manual');
    }) as [string, string][];
  }

  private get settings(): Bag {
    return (this.track?.getSettings() ?? {}) as Bag;
  }

  private get held(): boolean {
    return this.holdable.length > 0 && this.holdable.every(([mode]) => this.settings[mode] === 'manual');
  }

  private async toggle(): Promise<void> {
    const held = this.held;
    const request: Record<string, unknown> = {};
    for (const [mode] of this.holdable) {
      const automatic = (this.capabilities[mode] as string[]).find((choice) => choice !== 'manual' && choice !== 'none');
      request[mode] = held ? (automatic ?? 'manual') : 'manual';
    }
    if (!held) {
      // What the automatics have found is what is held.
      for (const { key, mode } of SETTINGS) if (mode && mode in request && key in this.settings) request[key] = this.settings[key];
    }
    await this.apply(request);
  }

  private async apply(request: Record<string, unknown>): Promise<void> {
    try {
      await this.track?.applyConstraints({ advanced: [request as MediaTrackConstraintSet] });
      this.show();
    } catch (error) {
      this.show();
      say(this.words, `The camera does not take this: ${error instanceof Error ? error.message : String(error)}`);
    }
  }

  private show(): void {
    const { holdable, held } = this;
    this.hold.disabled = holdable.length === 0;
    this.hold.setAttribute('aria-pressed', String(held));
    this.hold.textContent = held ? 'Exposure and focus are held' : 'Hold exposure and focus';
    say(this.words, this.advice(holdable, held));
    const rows = SETTINGS.flatMap((setting) => this.slider(setting) ?? []);
    this.sliders.replaceChildren(...rows);
  }

  private advice(holdable: readonly [string, string][], held: boolean): string {
    if (!this.track) return 'Start the camera to see what can be set.';
    const missing = MODES.filter(([mode]) => !holdable.some(([other]) => other === mode)).map(([, name]) => name);
    if (missing.length === MODES.length) {
      return 'This browser lets pages set nothing of this camera. Fix exposure and focus with another program ' +
        '(on Linux v4l2-ctl or guvcview), or give steady light.';
    }
    const rest = missing.length ? ` The browser cannot hold its ${missing.join(' and ')}.` : '';
    return (held ? 'Automatics are off.' : 'Automatics are on: hold them once the picture is good.') + rest;
  }

  private slider({ key, mode, label, unit }: Setting): HTMLElement | null {
    const range = rangeOf(this.capabilities[key]);
    if (!range) return null;
    const value = Number(this.settings[key] ?? range.min);
    const { min, max, step } = range;
    const input = make('input', { type: 'range', min, max, step, value });
    const shown = make('output', { class: 'number' }, `${value} ${unit}`);
    const automatic = mode !== undefined && this.settings[mode] !== 'manual';
    input.addEventListener('input', () => say(shown, `${input.value} ${unit}`));
    input.addEventListener('change', () => {
      const request: Record<string, unknown> = { [key]: Number(input.value) };
      if (mode && Array.isArray(this.capabilities[mode])) request[mode] = 'manual';
      void this.apply(request);
    });
    const row = field(automatic ? `${label} (automatic)` : label, input);
    row.append(shown);
    return row;
  }
}
