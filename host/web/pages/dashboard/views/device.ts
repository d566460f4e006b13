// How a push becomes motion: which profile, its curves with the hand on them, and sliders that are in force
// as they move.
import './device.css';
import { button, field, make, panel, present, say } from '../../common/elements';
import { type Sample, carriesNumbers } from '../../common/sample';
import { CurvePlot } from '../curve_plot';
import { KnobPanel } from '../knob_panel';
import { type AxisShape, PROFILE_AXES, ProfileText, withChanges } from '../profile_text';
import type { BridgeState, ProfileState } from '../protocol';
import type { App, View } from '../view';

export class DeviceView implements View {
  readonly name = 'device';
  readonly title = 'Device';
  readonly element = make('div');

  private readonly choice = make('select');
  private readonly plots = PROFILE_AXES.map(() => new CurvePlot());
  private readonly knobs: KnobPanel;
  private readonly textArea = make('textarea', {
    class: 'code',
    rows: 22,
    spellcheck: false,
    'aria-label': 'Text of the profile',
  });
  private readonly saveName = make('input', {
    type: 'text',
    pattern: '[A-Za-z0-9_\\-]+',
    maxlength: 60,
    autocomplete: 'off',
    placeholder: 'its own name',
  });
  private readonly trial = make('p', { class: 'trial', role: 'status', 'aria-live': 'polite' });
  private readonly none = make(
    'p',
    { class: 'panel', hidden: true },
    'This bridge runs without an input device, so there is no profile. ' +
      'Start it with --profile cad, or with a device: tagwrench run --output spacemouse --output web',
  );
  private readonly body = make('div', { class: 'device-body' });
  private readonly trialButtons: readonly HTMLButtonElement[];
  private text = new ProfileText('');
  private shown_: ProfileState | null = null;
  private latest: Sample | null = null;
  private request = 0;
  private visible = false;
  private tries = Promise.resolve();
  private nextTry: string | null = null;
  /** A text that was not taken stays in its box, to be mended. */
  private refused: string | null = null;
  private trying = 0;
  private shapes: readonly AxisShape[] = [];

  constructor(private readonly app: App) {
    this.knobs = new KnobPanel((changes) => this.attempt(this.text.with(changes)));
    // The bridge answers these with the name of the profile that is in force from then on.
    const inForce = (name: string): string => `Profile ${name} is in force`;
    const kept = (name: string): string => `Profile ${name} stays as tried until this run ends`;
    const reverted = (name: string): string => `Profile ${name} is in force, as it was before the trial`;
    this.choice.addEventListener(
      'change',
      () => void app.wishSaying(inForce, 'profile', { name: this.choice.value }),
    );
    this.trialButtons = [
      button('Keep', () => void app.wishSaying(kept, 'keep'), {
        class: 'main',
        title: 'In force until this run ends',
      }),
      button('Revert', () => void app.wishSaying(reverted, 'revert'), {
        title: 'As it was before the sliders moved',
      }),
    ];
    const next = button('Next', () => void app.wishSaying(inForce, 'next_profile'), {
      title: 'The next profile of the list',
    });
    const save = button('Save to a file', () => void this.save(), {
      title: 'Into the profile\u2019s file; a ready-made one becomes a file of your own, of this name',
    });
    const bar = panel(
      'Profile',
      'panel-profile',
      make(
        'div',
        { class: 'row' },
        field('in force', this.choice),
        next,
        ...this.trialButtons,
        field('save as', this.saveName),
        save,
      ),
      this.trial,
    );
    const plots = make('div', { class: 'curve-plots' }, ...this.plots.map((plot) => plot.element));
    const legend = make(
      'p',
      { class: 'hint' },
      'Deflection over push. Shaded: dead zone. Dashed: the way back. Dot: now.',
    );
    const curves = panel('Response', 'panel-curves', plots, legend);
    const tryText = button('Try this text', () => this.attempt(this.textArea.value));
    const details = make(
      'details',
      { class: 'panel' },
      make('summary', {}, 'Text of the profile'),
      this.textArea,
      make('div', { class: 'row' }, tryText),
    );
    this.body.append(
      bar,
      make('div', { class: 'column' }, curves, details),
      panel('Sliders (in force as they move)', 'panel-knobs', this.knobs.element),
    );
    this.element.append(this.none, this.body);
    app.link.on('state', (state) => this.showState(state));
    app.link.on('samples', ({ samples }) => {
      this.latest = samples.at(-1) ?? this.latest;
      if (this.visible && this.request === 0) this.request = requestAnimationFrame(() => this.drawNow());
    });
  }

  shown(on: boolean): void {
    this.visible = on;
  }

  private showState(state: BridgeState): void {
    const { profile } = state;
    present(this.none, profile === null);
    present(this.body, profile !== null);
    if (!profile || JSON.stringify(profile) === JSON.stringify(this.shown_)) return;
    const names = JSON.stringify(profile.names) !== JSON.stringify(this.shown_?.names);
    if (names)
      this.choice.replaceChildren(...profile.names.map((name) => make('option', { value: name }, name)));
    this.choice.value = profile.name;
    for (const one of this.trialButtons) one.disabled = !profile.trial;
    say(
      this.trial,
      profile.trial
        ? 'On trial: in force as long as this page is open. Keep it, save it or revert it.'
        : '\u00a0',
    );
    const ended = this.shown_?.trial === true && !profile.trial;
    const other = ended || profile.text !== this.shown_?.text || profile.name !== this.shown_.name;
    const before = this.shown_;
    this.shown_ = profile;
    // What is told while something is being tried may be what was before it.
    if (other && this.trying === 0) this.showText(profile, before);
  }

  private showText(profile: ProfileState, before: ProfileState | null = profile): void {
    const mending = this.refused !== null && this.textArea.value === this.refused;
    if (document.activeElement !== this.textArea && !mending) this.textArea.value = profile.text;
    if (profile.name !== before?.name) {
      this.saveName.value = '';
      this.saveName.placeholder = `${profile.name}-mine`;
    }
    this.take(new ProfileText(profile.text));
    if (!this.text.broken) this.knobs.show(this.text);
  }

  private take(text: ProfileText): void {
    this.text = text;
    if (text.broken) return;
    this.shapes = PROFILE_AXES.map((axis) => text.shape(axis));
    for (const [index, shape] of this.shapes.entries()) {
      const whole = Number.isFinite(shape.full) && Number.isFinite(shape.dead); // a text may leave them to the ready-made
      if (whole) this.plots[index]?.draw(shape);
    }
  }

  /** One at a time; of those that come meanwhile the newest counts. */
  private attempt(text: string): void {
    const waits = this.nextTry !== null;
    this.nextTry = text;
    const moved = new ProfileText(text);
    if (!moved.broken) this.take(moved);
    if (waits) return;
    ++this.trying;
    this.tries = this.tries.then(() => this.tryNewest());
  }

  private async tryNewest(): Promise<void> {
    const text = this.nextTry;
    this.nextTry = null;
    const name = this.shown_?.name;
    const answer =
      text !== null && name !== undefined ? await this.app.link.ask('try', { name, text }) : null;
    --this.trying;
    this.refused = answer && !answer.ok ? text : null;
    if (answer && !answer.ok) this.app.tell(answer.text, 'error');
    if (this.trying === 0 && this.shown_)
      this.showText(answer?.ok && text !== null ? { ...this.shown_, text } : this.shown_);
  }

  private async save(): Promise<void> {
    if (!this.saveName.reportValidity()) return;
    await this.tries;
    const name = this.shown_?.name ?? '';
    const shown = await this.app.link.ask('show', { name });
    const { file = '', written = '' } = (shown.data ?? {}) as { file?: string; written?: string };
    // A ready-made one has no file: it goes on as one of one's own.
    const as = file === '' ? this.saveName.value.trim() || `${name}-mine` : name;
    const text = this.text.with([[['name'], as]]);
    const file_text = shown.ok && !this.text.broken ? withChanges(written, shown.text, text) : text;
    await this.app.request('save_profile', { name, text, file_text, as });
  }

  private drawNow(): void {
    this.request = 0;
    const sample = this.latest;
    for (const [index, { source, invert }] of this.shapes.entries()) {
      const push =
        sample !== null && carriesNumbers(sample.status) ? this.pushAlong(source, sample) : Number.NaN;
      this.plots[index]?.show(invert ? -push : push, sample?.motion?.[index] ?? Number.NaN);
    }
  }

  /** N or N m along an axis of the device, before the profile. */
  private pushAlong(source: number, sample: Sample): number {
    const felt = source < 3 ? sample.f_n : sample.m_nm;
    const rows = this.app.link.hello?.hid_R_camera ?? [];
    return felt.reduce((sum, value, i) => sum + value * (rows[(source % 3) * 3 + i] ?? 0), 0);
  }
}
