// A job of the bridge as it goes on: what to do now, big; what has been covered; what was said; keys. All of
// it is the bridge's own state, so that a page that is loaded anew shows the same.
import './job_panel.css';
import { button, make, present, say } from '../common/elements';
import { CoverageView } from './coverage_view';
import { type Job, type JobState, textIn } from './protocol';
import { reportLines } from './report_text';
import type { App } from './view';

const STATE_WORDS: Readonly<Record<JobState, string>> = {
  running: 'runs',
  done: 'done',
  failed: 'failed',
  stopped: 'stopped',
};
const KEY_WORDS: Readonly<Record<string, string>> = {
  skip: 'Skip this step',
  redo: 'Do the last step again',
  stop: 'Stop',
};

/** The bars of the terminal, which the page draws itself. */
const DRAWN_BARS = /(?:covered:\s*)?(?:[FM][xyz] [#.]+[\s;]*){6}/;

function withoutBars(text: string): string {
  return text.replace(DRAWN_BARS, '').trimEnd();
}

export class JobPanel {
  readonly element: HTMLElement;

  private readonly heading = make('h3');
  private readonly task = make('p', { class: 'job-task', role: 'status', 'aria-live': 'polite' });
  private readonly live = make('p', { class: 'job-live number' });
  private readonly bar = make('i');
  private readonly progress = make(
    'div',
    { class: 'bar', role: 'progressbar', 'aria-label': 'progress' },
    this.bar,
  );
  private readonly coverage = new CoverageView();
  private readonly lines = make('ol', { class: 'job-lines', 'aria-label': 'What was said' });
  private readonly report = make('div', { class: 'report', role: 'region', 'aria-label': 'Report' });
  private readonly keys = make('div', { class: 'row' });
  private readonly close: HTMLButtonElement;
  private shown = '';

  constructor(
    private readonly app: App,
    private readonly titles: Readonly<Record<string, string>>,
  ) {
    this.close = button('Close', () => void app.wish('job_close'), { class: 'main' });
    this.element = make(
      'section',
      { class: 'panel job', 'aria-label': 'Job', hidden: true },
      this.heading,
      this.task,
      this.live,
      this.progress,
      this.coverage.element,
      this.report,
      this.keys,
      this.lines,
    );
  }

  show(job: Job | null): void {
    present(this.element, job !== null);
    if (!job) return;
    const text = JSON.stringify(job);
    if (text === this.shown) return;
    this.shown = text;
    this.element.className = `panel job ${job.state}`;
    say(this.heading, `${this.titles[job.verb] ?? job.verb}: ${STATE_WORDS[job.state]}`);
    say(this.task, JobPanel.headline(job));
    say(this.live, withoutBars(job.live) || '\u00a0');
    const running = job.state === 'running';
    present(this.live, running);
    present(this.progress, running && job.progress !== null);
    if (job.progress !== null) {
      this.bar.style.transform = `scaleX(${Math.max(0, Math.min(1, job.progress))})`;
      this.progress.setAttribute('aria-valuenow', String(Math.round(job.progress * 100)));
    }
    this.coverage.show(job.coverage);
    this.showReport(job);
    this.showKeys(job);
    this.showLines(job);
  }

  /** The newest first while it runs; after that in order, as tables are to be read, from its end. */
  private showLines(job: Job): void {
    const told = job.lines
      .map(({ kind, text }) => ({ kind, text: withoutBars(text) }))
      .filter(({ text }) => text !== '')
      .map(({ kind, text }) => make('li', { class: kind }, text));
    const running = job.state === 'running';
    this.lines.replaceChildren(...(running ? told.reverse() : told));
    this.lines.scrollTop = running ? 0 : this.lines.scrollHeight;
    present(this.lines, told.length > 0);
  }

  /** What it printed. The doctor's is shown by its own view, also after it is closed. */
  private showReport(job: Job): void {
    const text = job.verb === 'doctor' ? '' : textIn(job.result?.text);
    present(this.report, text !== '');
    this.report.replaceChildren(...(text === '' ? [] : reportLines(text)));
  }

  /** What there is to do, or how it ended. */
  private static headline(job: Job): string {
    const last = (kinds: readonly string[]): string =>
      job.lines.filter((line) => kinds.includes(line.kind)).at(-1)?.text ?? '';
    switch (job.state) {
      case 'running':
        return last(['task']) || withoutBars(job.live) || 'Starting\u2026';
      case 'done':
        // Above a report, a note of the way there would only confuse.
        return last(['result']) || (textIn(job.result?.text) === '' && last(['note'])) || 'Done.';
      case 'failed':
        return (
          last(['warning', 'note', 'result']) || 'It failed, and did not say why. Run `tagwrench doctor`.'
        );
      case 'stopped':
        return 'Stopped. What was in force before still is.';
    }
  }

  private showKeys(job: Job): void {
    const wanted = job.state === 'running' ? job.keys : ['close'];
    if (this.keys.dataset.keys === wanted.join()) return;
    this.keys.dataset.keys = wanted.join();
    const press = (key: string): HTMLButtonElement =>
      button(KEY_WORDS[key] ?? key, () => void this.app.wish('job_key', { key }));
    this.keys.replaceChildren(...wanted.map((key) => (key === 'close' ? this.close : press(key))));
  }
}
