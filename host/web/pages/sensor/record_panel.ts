// Start and stop of a recording, and its download as CSV.
import { button, make, panel, say } from '../common/elements';
import type { Sample } from '../common/sample';
import { download } from '../common/download';
import { Recorder } from './recorder';

const EVERY_MS = 250;

export class RecordPanel {
  private readonly recorder = new Recorder();
  private readonly toggle: HTMLButtonElement;
  private readonly save: HTMLButtonElement;
  private readonly words = make('span', { class: 'number', role: 'status' }, 'Nothing recorded');
  private shown_ms = 0;

  constructor(parent: HTMLElement) {
    this.toggle = button('Record', () => this.press(), { 'aria-pressed': 'false' });
    this.save = button('Download CSV', () => this.offer(), { disabled: true });
    parent.append(panel('Recording', 'record-panel', make('div', { class: 'row' }, this.toggle, this.save, this.words)));
  }

  add(sample: Sample): void {
    if (!this.recorder.running) return;
    this.recorder.add(sample);
    const now = performance.now();
    if (now - this.shown_ms < EVERY_MS && this.recorder.running) return;
    this.shown_ms = now;
    this.show();
  }

  private press(): void {
    if (this.recorder.running) this.recorder.stop();
    else this.recorder.start();
    this.show();
  }

  private offer(): void {
    const stamp = new Date().toISOString().slice(0, 19).replaceAll(':', '-');
    download(`tagwrench-${stamp}.csv`, this.recorder.file());
  }

  private show(): void {
    const { running, rows, seconds, full } = this.recorder;
    this.toggle.textContent = running ? 'Stop recording' : 'Record';
    this.toggle.setAttribute('aria-pressed', String(running));
    this.save.disabled = rows === 0;
    say(this.words, `${rows} samples, ${seconds.toFixed(1)} s${full ? ': full, ended by itself' : ''}`);
  }
}
