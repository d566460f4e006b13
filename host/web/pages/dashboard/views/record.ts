// Recordings: begin and end one while the sensor runs, see how it goes, fetch what there is.
import './record.css';
import { button, field, make, panel, present, say } from '../../common/elements';
import { listIn, numberIn, said, textIn, type BridgeState, type RecordingState } from '../protocol';
import { fetchFile } from '../../common/token';
import type { App, View } from '../view';
import { bytes, day, duration } from '../words';

const KEEP: readonly (readonly [string, string])[] = [
  ['region', 'the part of the pictures that is tracked (small)'],
  ['raw', 'whole pictures, as the camera sent them (large)'],
  ['none', 'numbers only, no pictures (tiny)'],
];

const IDLE = 'Nothing is being recorded.';
const UNABLE =
  'This run cannot be recorded from here: all of it is recorded already, or its source is a recording.';

interface Kept {
  name: string;
  bytes: number;
  date: string;
}

/** `name`, or with the first number behind it that is free: a recording replaces nothing. */
function freeName(name: string, taken: ReadonlySet<string>): string {
  if (!taken.has(`${name}.twr`)) return name;
  const stem = name.replace(/-\d+$/, '');
  let number = 2;
  while (taken.has(`${stem}-${number}.twr`)) ++number;
  return `${stem}-${number}`;
}

export class RecordView implements View {
  readonly name = 'record';
  readonly title = 'Record';
  readonly element = make('div');

  private readonly file = make('input', {
    type: 'text',
    value: 'push',
    maxlength: 80,
    pattern: '[A-Za-z0-9_.\\-]+',
    autocomplete: 'off',
    spellcheck: false,
  });
  private readonly keep = make(
    'select',
    {},
    ...KEEP.map(([value, words]) => make('option', { value }, words)),
  );
  private readonly start: HTMLButtonElement;
  private readonly stop: HTMLButtonElement;
  private readonly facts = make('dl', { class: 'facts wide' });
  private readonly words = make('p', { class: 'hint recording-words', role: 'status' }, IDLE);
  private readonly folder = make('p', { class: 'hint' });
  private able = true;
  private readonly rows = make('tbody');
  private readonly empty = make('p', { class: 'hint' }, 'None yet.');
  private readonly values = new Map<string, HTMLElement>();
  private running: boolean | null = null;
  private visible = false;

  constructor(private readonly app: App) {
    this.start = button('Start', () => void this.begin(), { class: 'main' });
    this.stop = button('Stop', () => void this.end(), { disabled: true });
    for (const name of ['file', 'time', 'size', 'frames', 'lost frames', 'disk full in']) {
      const value = make('dd', { class: 'number' }, '–');
      this.values.set(name, value);
      this.facts.append(make('dt', {}, name), value);
    }
    const now = panel(
      'Recording',
      '',
      field('name', this.file, 'Letters, digits, dot, - and _'),
      field('keep', this.keep),
      make('div', { class: 'row' }, this.start, this.stop),
      this.facts,
      this.words,
    );
    const head = ['name', 'size', 'made', ''].map((name) => make('th', { scope: 'col' }, name));
    const table = make(
      'table',
      { class: 'list' },
      make('caption', { class: 'unseen' }, 'Recordings'),
      make('thead', {}, make('tr', {}, ...head)),
      this.rows,
    );
    const hint = make(
      'p',
      { class: 'hint' },
      'Play one with: tagwrench run --source recording:FILE. Export it with: tagwrench export FILE.',
    );
    this.element.append(
      now,
      panel('Recordings on the computer of the bridge', '', this.folder, table, this.empty, hint),
    );
    app.link.on('state', (state) => this.showState(state));
    app.link.on('hello', ({ can }) => {
      this.able = can.record;
      say(this.words, can.record ? IDLE : UNABLE);
      if (this.visible) void this.list();
    });
  }

  shown(on: boolean): void {
    this.visible = on;
    if (on) void this.list();
  }

  private async begin(): Promise<void> {
    if (!this.file.reportValidity()) return;
    await this.app.wishSaying((name) => `Recording begun: ${name}`, 'record_start', {
      name: this.file.value.trim() || 'recording',
      keep: this.keep.value,
    });
  }

  private async end(): Promise<void> {
    const ended = (file: string): string => `Recording ended: ${file}`;
    const answer = await this.app.wishSaying(ended, 'record_stop');
    if (answer.ok) say(this.words, ended(answer.text));
    await this.list();
  }

  private showState({ recording }: BridgeState): void {
    const running = recording !== null;
    this.start.disabled = running || !this.able;
    this.stop.disabled = !running;
    if (this.running === true && !running) {
      say(this.words, 'Recording ended.');
      if (this.visible) void this.list();
    }
    this.running = running;
    if (recording) this.showProgress(recording);
  }

  private showProgress(recording: RecordingState): void {
    say(this.words, 'Recording.');
    const words: Readonly<Record<string, string>> = {
      file: recording.file,
      time: duration(recording.seconds),
      size: bytes(recording.bytes),
      frames: String(recording.frames),
      'lost frames': String(recording.dropped),
      'disk full in': duration(recording.disk_left_s),
    };
    for (const [name, element] of this.values) say(element, words[name] ?? '');
    this.values.get('disk full in')?.classList.toggle('error', recording.disk_left_s < 60);
    this.values.get('lost frames')?.classList.toggle('warn', recording.dropped > 0);
  }

  private async list(): Promise<void> {
    const answer = await this.app.link.ask('recordings');
    if (!answer.ok) return;
    const kept: Kept[] = listIn(answer.data, (one) => ({
      name: textIn(said(one).name),
      bytes: numberIn(said(one).bytes),
      date: textIn(said(one).date),
    }));
    say(this.folder, answer.text);
    if (document.activeElement !== this.file)
      this.file.value = freeName(this.file.value.trim(), new Set(kept.map((one) => one.name)));
    present(this.empty, kept.length === 0);
    this.rows.replaceChildren(...kept.filter((one) => one.name !== '').map((one) => this.row(one)));
  }

  private row(one: Kept): HTMLElement {
    const address = `/files/recordings/${encodeURIComponent(one.name)}`;
    const words = { class: 'button', download: one.name, 'aria-label': `Download ${one.name}` };
    const get =
      this.app.token === ''
        ? make('a', { href: address, ...words }, 'Download')
        : button('Download', () => void this.download(one.name, address), {
            'aria-label': words['aria-label'],
          });
    const cell = (text: string, name = ''): HTMLElement => make('td', { class: name }, text);
    return make(
      'tr',
      {},
      make('th', { scope: 'row' }, one.name),
      cell(bytes(one.bytes), 'number'),
      cell(day(one.date), 'number'),
      make('td', {}, get),
    );
  }

  /** With a token, which a link cannot carry. */
  private async download(name: string, address: string): Promise<void> {
    try {
      const url = URL.createObjectURL(await fetchFile(address, this.app.token));
      make('a', { href: url, download: name }).click();
      setTimeout(() => URL.revokeObjectURL(url), 60_000);
    } catch (failure) {
      this.app.tell(failure instanceof Error ? failure.message : String(failure), 'error');
    }
  }
}
