// What `tagwrench doctor` says about this computer, readable.
import { button, make, panel, present } from '../../common/elements';
import { JobPanel } from '../job_panel';
import { type Job, textIn } from '../protocol';
import { reportLines } from '../report_text';
import type { App, View } from '../view';

export class DoctorView implements View {
  readonly name = 'doctor';
  readonly title = 'Doctor';
  readonly element = make('div');

  private readonly job: JobPanel;
  private readonly report = make('div', {
    class: 'panel report',
    hidden: true,
    role: 'region',
    'aria-label': 'Report',
  });
  private shownText = '';

  constructor(app: App) {
    this.job = new JobPanel(app);
    const start = button('Examine', () => void app.begin('doctor', {}), {
      class: 'main',
    });
    const copy = button(
      'Copy',
      () =>
        void navigator.clipboard.writeText(this.shownText).then(
          () => app.tell('the report is on the clipboard', 'good'),
          () => app.tell('the browser does not allow copying here; mark the text instead', 'error'),
        ),
    );
    const about =
      'Looks at the camera, the devices, rights, and programs that read them, and says what to do about what is amiss.';
    const top = panel('Doctor', '', make('p', {}, about), make('div', { class: 'row' }, start, copy));
    this.element.append(make('div', { class: 'column' }, top, this.job.element), this.report);
    app.link.on('job', (job) => this.show(job));
    app.link.on('state', (state) => this.show(state.job));
    app.link.on('hello', ({ can }) => {
      start.disabled = !can.jobs.includes('doctor');
    });
  }

  private show(job: Job | null): void {
    const mine = job?.verb === 'doctor' ? job : null;
    this.job.show(mine);
    const text = textIn(mine?.result?.text);
    if (text === '' || text === this.shownText) return;
    this.shownText = text;
    present(this.report, true);
    this.report.replaceChildren(...reportLines(text));
  }
}
