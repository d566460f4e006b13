// A job of the bridge as it goes on: what to do now, big; keys; what has been covered; what was said. All of
// it is the bridge's own state, so that a page that is loaded anew shows the same. Each part has its room from
// the start: nothing moves away from under a finger while it runs.
import './job_panel.css';
import { button, make, present, say } from '../common/elements';
import { CoverageView } from './coverage_view';
import { endingOf, jobTitle, lastSaid } from './job_words';
import { type Coverage, type Job, type JobState, textIn } from './protocol';
import { reportLines } from './report_text';
import type { App } from './view';

const STATE_WORDS: Readonly<Record<JobState, string>> = {
  running: 'runs',
  done: 'Done',
  failed: 'Failed',
  stopped: 'Stopped',
};
const KEY_WORDS: Readonly<Record<string, string>> = {
  skip: 'Skip this step',
  redo: 'Do the last step again',
  stop: 'Stop',
};

/** What will be covered, before there is any of it. */
const NOTHING_YET: Readonly<Record<string, Coverage>> = {
  camera: { regions: Array<number>(9).fill(0) },
  target: { range: Array<number>(6).fill(0) },
  wrench: { axes: Array<number>(6).fill(0) },
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

  constructor(private readonly app: App) {
    this.close = button('Close', () => void app.close(), { class: 'main' });
    this.element = make(
      'section',
      { class: 'panel job', 'aria-label': 'Job', hidden: true },
      this.heading,
      this.task,
      this.live,
      this.progress,
      this.keys,
      this.coverage.element,
      this.report,
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
    const ending = endingOf(job);
    const title = jobTitle(job.verb);
    say(this.heading, ending ? STATE_WORDS[job.state] : `${title}: ${STATE_WORDS[job.state]}`);
    say(this.task, ending?.what ?? (lastSaid(job, ['task']) || withoutBars(job.live) || 'Starting\u2026'));
    say(this.live, ending?.more ?? withoutBars(job.live));
    this.progress.classList.toggle('none', job.progress === null);
    if (job.progress !== null) {
      this.bar.style.transform = `scaleX(${Math.max(0, Math.min(1, job.progress))})`;
      this.progress.setAttribute('aria-valuenow', String(Math.round(job.progress * 100)));
    }
    this.coverage.show(job.coverage ?? (ending ? null : (NOTHING_YET[job.verb] ?? null)));
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
    // The doctor says nothing on its way; above a report stands what matters.
    const reported = textIn(job.result?.text) !== '';
    present(this.lines, running ? job.verb !== 'doctor' : told.length > 0 && !reported);
  }

  /** What it printed. The doctor's is shown by its own view, also after it is closed. */
  private showReport(job: Job): void {
    const text = job.verb === 'doctor' ? '' : textIn(job.result?.text);
    present(this.report, text !== '');
    this.report.replaceChildren(...(text === '' ? [] : reportLines(text)));
  }

  private showKeys(job: Job): void {
    const wanted = job.state === 'running' ? job.keys : ['close'];
    if (this.keys.dataset.keys === wanted.join()) return;
    this.keys.dataset.keys = wanted.join();
    const press = (key: string): HTMLButtonElement =>
      button(KEY_WORDS[key] ?? key, () => void this.app.request('job_key', { key }));
    this.keys.replaceChildren(...wanted.map((key) => (key === 'close' ? this.close : press(key))));
  }
}
