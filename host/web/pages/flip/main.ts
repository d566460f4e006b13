// A screen that flips between black and white: for `tagwrench camera-timing` (opened with #screen, from its own address), for this browser's
// camera, which measures how late it sees it, or for any other.
import '../common/theme.css';
import './flip.css';
import { button, field, make, panel, present, say } from '../common/elements';
import { themeSwitch } from '../common/theme';
import { Camera } from '../sensor/camera';
import { firstCameraTrouble } from '../sensor/checks';
import { download } from '../common/download';
import { BrightnessReader } from './brightness';
import { FlipMeasurement, type Result, reportJson, reportText } from './measurement';
import { Patch } from './patch';
import { ProgramScreen } from './program_screen';
import { takeToken } from '../common/token';

/** Flashes, that is white and black again, a second. Up to 3 are held to be safe for nearly everybody (WCAG 2.3.1). */
const SAFE_HZ = 3;
const MOST_HZ = 12;
const FLIPS = 60;

class FlipPage {
  private readonly patch: Patch;
  private readonly progress = make('div', { class: 'progress', role: 'status', hidden: true });
  private readonly trouble = make('p', { class: 'error', role: 'alert' });
  private readonly results = make('div', { class: 'results-holder' });
  private readonly agree = make('input', { type: 'checkbox' });
  private readonly rate = make('input', { type: 'range', min: 0.5, max: SAFE_HZ, step: 0.5, value: SAFE_HZ });
  private readonly rateWords = make('output', { class: 'number' });
  private readonly measureButton = button('Measure with this camera', () => void this.measure(), { class: 'main', disabled: true });
  private readonly flipButton = button('Only flip', () => void this.onlyFlip(), { disabled: true });
  private readonly screenButton = button('Be the screen', () => void this.beTheScreen(), { class: 'main', disabled: true });
  private readonly token = takeToken();
  private readonly forProgram = location.hash === '#screen';
  private end = (): void => {};

  constructor(root: HTMLElement) {
    this.patch = new Patch(document.body, () => 500 / Number(this.rate.value));
    document.body.append(this.progress);
    const faster = make('input', { type: 'checkbox' });
    faster.addEventListener('change', () => {
      this.rate.max = String(faster.checked ? MOST_HZ : SAFE_HZ);
      this.showRate();
    });
    this.agree.addEventListener('change', () => this.allow());
    this.rate.addEventListener('input', () => this.showRate());
    const rate = field('At most', this.rate);
    rate.append(this.rateWords);
    root.append(
      make('div', { class: 'row' }, make('h1', {}, 'A screen that flips'), themeSwitch()),
      make('p', {}, 'Point the camera at this screen, so that the page fills its picture, and fix its exposure. The screen turns ' +
        'black and white, and as soon as the camera has seen it, back: that is how late a picture comes, ' +
        `screen and ${this.forProgram ? 'camera' : 'browser'} included.`),
      make('section', { class: 'panel warning', 'aria-label': 'Warning' },
        make('h2', {}, 'Flashing light can bring on fits in people with photosensitive epilepsy'),
        make('p', {}, 'The whole screen flashes. Do not go on if you, or somebody who sees this screen, may be sensitive. ' +
          'Any key or touch ends it at once.'),
        make('p', {}, make('label', {}, this.agree, 'Nobody here is sensitive to flashing light')),
        make('p', {}, make('label', {}, faster, `Allow more than ${SAFE_HZ} flashes a second (up to ${MOST_HZ})`))),
      panel('Flip', '', rate, make('div', { class: 'row' }, ...this.buttons()), this.trouble, this.results),
    );
    addEventListener('keydown', () => this.end());
    addEventListener('pointerdown', () => this.end());
    addEventListener('visibilitychange', () => this.end());
    this.showRate();
  }

  private showRate(): void {
    say(this.rateWords, `${Number(this.rate.value).toFixed(1)} flashes a second`);
  }

  private allow(): void {
    for (const one of [this.measureButton, this.flipButton, this.screenButton]) one.disabled = !this.agree.checked;
  }

  private buttons(): HTMLElement[] {
    return this.forProgram ? [this.screenButton] : [this.measureButton, this.flipButton];
  }

  /** For the program that serves this page; it has the camera. */
  private async beTheScreen(): Promise<void> {
    this.begin();
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    const screen = new ProgramScreen(`${scheme}://${location.host}/ws`, this.token, this.patch, (line) => say(this.progress, line));
    say(this.progress, 'waiting for the program; any key ends it');
    await this.shown(true);
    this.end = () => screen.leave();
    const why = await screen.serve();
    await this.finish();
    this.results.replaceChildren(make('p', { role: 'status' }, why));
  }

  private async shown(on: boolean): Promise<void> {
    present(this.progress, on);
    this.patch.present(on);
    try {
      if (on) await document.documentElement.requestFullscreen();
      else if (document.fullscreenElement) await document.exitFullscreen();
    } catch {
      // As large as the window then.
    }
  }

  /** Black and white at the chosen rate, in step with the screen, until somebody ends it. */
  private async onlyFlip(): Promise<void> {
    this.begin();
    let going = true;
    await this.shown(true);
    this.end = () => {
      going = false;
    };
    const from = performance.now();
    while (going) {
      const now = await this.patch.flip(!this.patch.isWhite, 0);
      say(this.progress, `${((500 * this.patch.flips) / Math.max(now - from, 1)).toFixed(2)} flashes a second; any key ends it`);
    }
    await this.finish();
  }

  private async measure(): Promise<void> {
    this.begin();
    const trouble = firstCameraTrouble();
    if (trouble) return say(this.trouble, `${trouble.title}. ${trouble.advice}`);
    const camera = new Camera(() => undefined);
    await camera.open({ deviceId: '', width: 640, height: 480, rate_hz: 60 });
    const { state } = camera;
    if (state.name !== 'open') {
      if (state.name === 'failed') say(this.trouble, `${state.trouble.title}. ${state.trouble.advice}`);
      return;
    }
    const measurement = new FlipMeasurement(this.patch, (line) => say(this.progress, `${line}; any key ends it`));
    const reader = new BrightnessReader((picture) => measurement.picture(picture));
    reader.start(state.track);
    await this.shown(true);
    this.end = () => measurement.stop();
    try {
      this.show(await measurement.measure(FLIPS), state.track.label);
    } catch (error) {
      say(this.trouble, error instanceof Error ? error.message : String(error));
    }
    reader.stop();
    camera.close();
    await this.finish();
  }

  private begin(): void {
    say(this.trouble, '');
    this.results.replaceChildren();
  }

  private async finish(): Promise<void> {
    this.end = () => {};
    await this.shown(false);
  }

  private show(result: Result, camera: string): void {
    const table = make('table', { class: 'results' });
    for (const [name, value, remark] of reportText(result)) {
      table.append(make('tr', {}, make('th', { scope: 'row' }, name), make('td', { class: 'number' }, value), make('td', { class: 'hint' }, remark)));
    }
    const save = button('Download JSON', () => {
      download('tagwrench-screen.json', new Blob([reportJson(result, camera)], { type: 'application/json' }));
    });
    this.results.replaceChildren(table, save);
  }
}

new FlipPage(document.getElementById('flip') ?? document.body);
