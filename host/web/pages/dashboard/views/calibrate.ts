// The calibrations, step by step, in the order in which they are done; and what keeps them true.
import './calibrate.css';
import { button, field, make, panel, present, say } from '../../common/elements';
import { CameraPicture } from '../camera_picture';
import { JobPanel } from '../job_panel';
import { jobTitle } from '../job_words';
import { type Hello, type Job, listIn, numberIn, said, textIn } from '../protocol';
import type { App, View } from '../view';

const NEXT: Readonly<Record<string, string>> = {
  camera: 'Next: the target. Its places belong to this lens.',
  target: 'Next: the wrench. Its newtons belong to these tags.',
  wrench: 'Next: make the certificate, and press zero with hands off.',
};
const BOARDS: readonly (readonly [string, string])[] = [
  ['charuco:9x6:1.2mm:0.9mm:aruco_4x4_50', 'ChArUco, 9 x 6 squares of 1.2 mm (for 20 mm of distance)'],
  ['charuco:7x5:30mm:22mm:aruco_4x4_50', 'ChArUco, 7 x 5 squares of 30 mm (a sheet of A4)'],
  ['checkerboard:9x6:1.2mm', 'checkerboard, 9 x 6 squares of 1.2 mm'],
];

interface Plan {
  name: string;
  needs: string;
  minutes: number;
  steps: number;
}

export class CalibrateView implements View {
  readonly name = 'calibrate';
  readonly title = 'Calibrate';
  readonly element = make('div');

  private readonly job: JobPanel;
  private readonly next = make('p', { class: 'panel next', hidden: true });
  private readonly jobRow = make('div', { class: 'job-row', hidden: true });
  private readonly choices = make('div', { class: 'wizards' });
  private readonly picture: CameraPicture;
  private readonly pictured: HTMLElement;
  private readonly board = make('input', {
    type: 'text',
    list: 'boards',
    value: BOARDS[0]?.[0] ?? '',
    maxlength: 120,
    spellcheck: false,
    autocomplete: 'off',
  });
  private readonly seconds = make('input', { type: 'number', min: 5, max: 600, value: 30 });
  private readonly plan = make('select');
  private readonly planNeeds = make('p', { class: 'plan-needs' });
  private readonly resume = make('input', { type: 'checkbox' });
  private readonly mass = make('input', {
    type: 'number',
    min: 1,
    max: 5000,
    step: 'any',
    placeholder: 'none',
    'aria-label': 'known mass, g',
  });
  private readonly at = make('input', {
    type: 'text',
    value: '15, 0, 6',
    size: 10,
    'aria-label': 'where it hangs: x, y, z in mm',
  });
  private readonly known = make('p', { class: 'hint' });
  private plans: readonly Plan[] = [];
  private visible = false;
  private withPicture = false;

  constructor(private readonly app: App) {
    this.job = new JobPanel(app);
    this.picture = new CameraPicture(app.link, 'what the camera sees');
    this.pictured = panel('Camera', 'wizard-picture', this.picture.element);
    this.plan.addEventListener('change', () => this.showPlan());
    this.choices.append(this.cameraCard(), this.targetCard(), this.wrenchCard(), this.keepCard());
    this.jobRow.append(make('div', { class: 'column' }, this.job.element, this.next), this.pictured);
    this.element.append(this.jobRow, this.known, this.choices);
    app.link.on('job', (job) => this.showJob(job));
    app.link.on('state', (state) => this.showJob(state.job));
    app.link.on('hello', (hello) => this.showHello(hello));
  }

  shown(on: boolean): void {
    this.visible = on;
    this.picture.shown(on && this.withPicture);
    if (on) void this.fetchPlans();
  }

  private card(verb: string, number: string, about: string, ...controls: readonly Node[]): HTMLElement {
    const title = number === '' ? 'Keep it true' : `${number}. ${jobTitle(verb)}`;
    return panel(title, 'wizard', make('p', {}, about), ...controls);
  }

  private cameraCard(): HTMLElement {
    const list = make(
      'datalist',
      { id: 'boards' },
      ...BOARDS.map(([value, words]) => make('option', { value }, words)),
    );
    const form = field(
      'board',
      this.board,
      'As it is printed on the sheet: kind, columns x rows of squares, edge of a square, of a marker, family.',
    );
    const start = this.starter('camera', () => ({ board: this.board.value.trim() }));
    return this.card(
      'camera',
      '1',
      'Lens and sharpness: show a printed board to the camera, from all sides, until the map is filled.',
      form,
      list,
      start,
    );
  }

  private targetCard(): HTMLElement {
    const start = this.starter('target', () => ({ seconds: Number(this.seconds.value) || 30 }));
    return this.card(
      'target',
      '2',
      'Where the tags sit: take the platform by the knob and move it slowly in all six directions.',
      field('seconds', this.seconds),
      start,
    );
  }

  private wrenchCard(): HTMLElement {
    const resume = make('label', {}, this.resume, 'go on where the last one stopped');
    const start = this.starter('wrench', () => ({
      plan: this.plan.value,
      ...(this.resume.checked ? { resume: true } : {}),
    }));
    return this.card(
      'wrench',
      '3',
      'From movement to newtons: hang known loads, as the plan says, step by step.',
      field('plan', this.plan),
      this.planNeeds,
      resume,
      start,
    );
  }

  private keepCard(): HTMLElement {
    const check = this.starter('check', () => this.knownMass(), 'Check');
    const zero = this.starter('zero', () => ({}), 'Zero, and write it down');
    const row = make('div', { class: 'row' }, this.mass, ' g at ', this.at, ' mm');
    return this.card(
      'check',
      '',
      'Check light, focus, tags and scale against the calibration (a known mass is optional); or store what reads with hands off as zero.',
      row,
      make('div', { class: 'row' }, check, zero),
    );
  }

  private knownMass(): Record<string, unknown> {
    const mass = Number(this.mass.value);
    const at = this.at.value
      .split(/[\s,;]+/)
      .filter((part) => part !== '')
      .map(Number);
    return mass > 0 && at.length === 3 && at.every(Number.isFinite) ? { mass_g: mass, at } : {};
  }

  private starter(verb: string, options: () => Record<string, unknown>, words = 'Start'): HTMLButtonElement {
    return button(words, () => void this.app.begin(verb, options()), {
      class: 'main',
      'data-verb': verb,
    });
  }

  private showHello(hello: Hello): void {
    const springs =
      hello.axes_from_springs.length > 0
        ? ` From the springs' description alone: ${hello.axes_from_springs.join(', ')}.`
        : '';
    say(
      this.known,
      hello.calibrated
        ? `Calibrated ${hello.calibrated}.${springs} Sensor: ${hello.sensor}.`
        : `Not calibrated: newtons come from the springs' description. Sensor: ${hello.sensor}.`,
    );
    const off = new Set<string>();
    for (const start of this.element.querySelectorAll<HTMLButtonElement>('button[data-verb]')) {
      start.disabled = !hello.can.jobs.includes(start.dataset.verb ?? '');
      start.title = start.disabled
        ? 'This bridge cannot: it needs a sensor file (--sensor sensor.yaml) and a camera or the simulation'
        : '';
      if (start.disabled) off.add(jobTitle(start.dataset.verb ?? '').toLowerCase());
    }
    if (off.size > 0)
      this.known.append(
        off.has('target calibration')
          ? ' Nothing to calibrate here: start `tagwrench run` with --sensor sensor.yaml, and a camera or the simulation.'
          : ` Not with this source: ${[...off].join(', ')}.`,
      );
    if (this.visible) void this.fetchPlans();
  }

  private showJob(job: Job | null): void {
    const mine = job && job.verb !== 'doctor' && job.verb !== 'certificate' ? job : null;
    this.job.show(mine);
    present(this.jobRow, mine !== null);
    for (const part of [this.known, this.choices]) present(part, job === null);
    const next = mine?.state === 'done' ? NEXT[mine.verb] : undefined;
    present(this.next, next !== undefined);
    if (next) say(this.next, next);
    this.withPicture = mine?.state === 'running';
    present(this.pictured, this.withPicture);
    this.picture.shown(this.visible && this.withPicture);
  }

  private async fetchPlans(): Promise<void> {
    if (this.plans.length > 0) return;
    const answer = await this.app.link.ask('plans');
    this.plans = listIn(answer.ok ? answer.data : null, (one) => {
      const { name, needs, minutes, steps } = said(one);
      return { name: textIn(name), needs: textIn(needs), minutes: numberIn(minutes), steps: numberIn(steps) };
    });
    this.plan.replaceChildren(
      ...this.plans.map(({ name }) => make('option', { value: name }, name.replaceAll('_', ' '))),
    );
    this.showPlan();
  }

  private showPlan(): void {
    const plan = this.plans.find((one) => one.name === this.plan.value);
    const time = plan && plan.minutes > 0 ? `; about ${plan.minutes} minutes` : '';
    say(this.planNeeds, plan ? `Needs ${plan.needs}. ${plan.steps} steps${time}.` : '');
  }
}
