// Newtons of the bridge's wrench sensor, beside those of this tab.
import { button, make, say } from '../../common/elements';
import { AXES, type Sample, carriesNumbers, figure, wrenchOf } from '../../common/sample';
import { WrenchHid } from './wrench_hid';

export class HidReadout {
  readonly element = make('section', { 'aria-label': 'The bridge\'s device' });
  private readonly words = make('p', { class: 'hint', role: 'status' });
  private readonly values = AXES.map(() => make('span', { class: 'number' }, '–'));
  private readonly hid = new WrenchHid((sample) => this.show(sample), (line) => say(this.words, line));
  private latest: Sample | null = null;

  constructor() {
    const connect = button('Read the bridge\'s newtons', () => void this.connect());
    const list = make('dl', { class: 'hid-values' });
    AXES.forEach(({ name, title, unit }, i) => {
      list.append(make('div', {}, make('dt', { title }, name), make('dd', {}, this.values[i] ?? '', ` ${unit}`)));
    });
    this.element.append(make('div', { class: 'row' }, connect), this.words, list);
  }

  private async connect(): Promise<void> {
    try {
      await this.hid.connect();
    } catch (error) {
      say(this.words, error instanceof Error ? error.message : String(error));
    }
  }

  private show(sample: Sample): void {
    const asked = this.latest !== null;
    this.latest = sample;
    if (!asked) requestAnimationFrame(() => this.draw());
  }

  private draw(): void {
    const sample = this.latest;
    this.latest = null;
    if (!sample) return;
    AXES.forEach(({ scale, decimals }, i) => {
      const value = this.values[i];
      if (value) say(value, carriesNumbers(sample.status) ? figure(wrenchOf(sample, i) * scale, decimals) : '–');
    });
  }
}
