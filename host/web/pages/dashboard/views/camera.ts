// The camera's own settings, the board's light, and the load cells.
import '../knobs.css';
import './record.css';
import { button, make, panel, present, say } from '../../common/elements';
import { figure } from '../../common/sample';
import { CameraPicture } from '../camera_picture';
import type { BridgeState, CameraControl, Hello } from '../protocol';
import { Quality } from '../quality';
import type { App, View } from '../view';

/** A slider sends at most so often; the last place always. */
const EVERY_MS = 100;

/** Calls at once, and then at most every EVERY_MS with the newest value. */
function paced(send: (value: number) => void): (value: number) => void {
  let waiting: number | null = null;
  let timer: ReturnType<typeof setTimeout> | null = null;
  const next = (): void => {
    timer = null;
    if (waiting === null) return;
    send(waiting);
    waiting = null;
    timer = setTimeout(next, EVERY_MS);
  };
  return (value) => {
    waiting = value;
    if (timer === null) next();
  };
}

function spoken(name: string): string {
  return name.replaceAll('_', ' ');
}

interface ControlRow {
  show(control: CameraControl): void;
}

export class CameraView implements View {
  readonly name = 'camera';
  readonly title = 'Camera & light';
  readonly element = make('div');

  private readonly picture: CameraPicture;
  private readonly quality = new Quality();
  private readonly controls = make('div', { class: 'knobs' });
  private readonly noControls = make(
    'p',
    { class: 'hint' },
    'This source has no settings: it is no live camera.',
  );
  private readonly light: HTMLElement;
  private readonly level = make('input', { type: 'range', id: 'led-level', min: 0, max: 100, step: 1 });
  private readonly levelWords = make('output', { class: 'number knob-value', for: 'led-level' }, '–');
  private readonly boardWords = make('p', { class: 'hint' });
  private readonly cells = make('tbody');
  private readonly cellsPanel: HTMLElement;
  private readonly cellValues = new Map<number, readonly [HTMLElement, HTMLElement]>();
  private rows = new Map<number, ControlRow>();
  private outline = '';

  constructor(private readonly app: App) {
    this.picture = new CameraPicture(app.link, 'camera picture');
    const setLevel = paced((value) => void this.tellFailure('led', { level: value / 100 }));
    this.level.addEventListener('input', () => setLevel(Number(this.level.value)));
    const auto = button('Automatic', () => void app.request('led', { level: 'auto' }), {
      title: 'The bridge keeps the tags\u2019 white where it should be',
    });
    const row = make(
      'div',
      { class: 'knob' },
      make('label', { for: 'led-level' }, 'level'),
      this.level,
      this.levelWords,
    );
    this.light = panel('Light of the board', '', row, make('div', { class: 'row' }, auto), this.boardWords);
    const head = ['cell', 'force, N', 'σ, N', ''].map((name) => make('th', { scope: 'col' }, name));
    const table = make(
      'table',
      { class: 'list cells' },
      make('caption', { class: 'unseen' }, 'Load cells'),
      make('thead', {}, make('tr', {}, ...head)),
      this.cells,
    );
    this.cellsPanel = panel('Load cells of the board', '', table);
    const settings = panel('Camera settings', '', this.controls, this.noControls);
    const picture = panel('Camera', '', this.picture.element, this.quality.element);
    this.element.append(
      make('div', { class: 'column' }, settings, this.light, this.cellsPanel),
      make('div', { class: 'column' }, picture),
    );
    app.link.on('hello', (hello) => this.showHello(hello));
    app.link.on('state', (state) => this.showState(state));
  }

  shown(on: boolean): void {
    this.picture.shown(on);
  }

  private showHello({ can }: Hello): void {
    present(this.light, can.led);
    present(this.cellsPanel, can.cells.length > 0);
  }

  /** Sliders report failures alone: a line for every step would be noise. */
  private async tellFailure(what: string, extra: Readonly<Record<string, unknown>>): Promise<void> {
    const answer = await this.app.link.ask(what, extra);
    if (!answer.ok) this.app.tell(answer.text, 'error');
  }

  private showState(state: BridgeState): void {
    this.quality.show(state.image);
    present(this.noControls, state.camera_controls.length === 0);
    const outline = JSON.stringify(state.camera_controls.map(({ value: _, ...fixed }) => fixed));
    if (outline !== this.outline) {
      this.outline = outline;
      this.rows = new Map();
      this.controls.replaceChildren(...state.camera_controls.map((control) => this.controlRow(control)));
    }
    for (const control of state.camera_controls) this.rows.get(control.id)?.show(control);
    if (state.board) this.showBoard(state.board);
  }

  private showBoard(board: NonNullable<BridgeState['board']>): void {
    if (!this.level.matches(':active')) this.level.value = String(Math.round(board.led * 100));
    say(this.levelWords, Number.isFinite(board.led) ? `${figure(board.led * 100, 0)} %` : '–');
    say(
      this.boardWords,
      board.exposure_us > 0
        ? `lit for ${figure(board.exposure_us / 1e3, 2)} ms of every picture`
        : 'lit all the time',
    );
    for (const cell of board.cells) {
      const values = this.cellValues.get(cell.channel) ?? this.cellRow(cell.channel);
      say(values[0], figure(cell.n, 3));
      say(values[1], `±${figure(cell.sigma_n, 3)}`);
    }
  }

  private cellRow(channel: number): readonly [HTMLElement, HTMLElement] {
    const values = [make('td', { class: 'number' }), make('td', { class: 'number' })] as const;
    const tare = button('Tare', () => void this.app.request('tare', { channel }), {
      'aria-label': `Tare cell ${channel}`,
    });
    this.cells.append(
      make('tr', {}, make('th', { scope: 'row' }, `cell ${channel}`), ...values, make('td', {}, tare)),
    );
    this.cellValues.set(channel, values);
    return values;
  }

  private static note(control: CameraControl): string {
    if (!control.writable) return 'read only: another setting governs it';
    return control.minimum === 0 && control.maximum === 1
      ? ''
      : `${figure(control.minimum, 0)} to ${figure(control.maximum, 0)}`;
  }

  private controlRow(control: CameraControl): HTMLElement {
    const id = `control-${control.id}`;
    const label = make('label', { for: id }, spoken(control.name));
    const send = paced((value) => void this.tellFailure('camera_set', { control: control.id, value }));
    const two = control.minimum === 0 && control.maximum === 1;
    const shown = make('output', { class: 'number knob-value', for: id });
    const input = two
      ? make('input', { type: 'checkbox', id, disabled: !control.writable })
      : make('input', {
          type: 'range',
          id,
          min: control.minimum,
          max: control.maximum,
          step: control.step,
          disabled: !control.writable,
        });
    const words = (value: number): string => (two ? (value ? 'on' : 'off') : figure(value, 0));
    input.addEventListener('input', () => {
      const value = two ? Number(input.checked) : Number(input.value);
      say(shown, words(value));
      send(value);
    });
    this.rows.set(control.id, {
      show: ({ value }) => {
        if (input.matches(':active')) return;
        if (two) input.checked = value !== 0;
        else input.value = String(value);
        say(shown, words(value));
      },
    });
    const note = make('span', { class: 'hint' }, CameraView.note(control));
    return make(
      'div',
      { class: control.writable ? 'knob noted' : 'knob noted fixed' },
      label,
      input,
      shown,
      note,
    );
  }
}
