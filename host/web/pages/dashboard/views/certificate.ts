// The sensor's certificate: how well it measures, by its own calibration.
import { button, make, panel, present } from '../../common/elements';
import { JobPanel } from '../job_panel';
import { type Job, textIn } from '../protocol';
import { fetchFile } from '../../common/token';
import type { App, View } from '../view';

const KINDS = ['pdf', 'json', 'html'] as const;
/** What the certificate's page is wide, with its scroll bar. */
const SHEET_PX = 760;

export class CertificateView implements View {
  readonly name = 'certificate';
  readonly title = 'Certificate';
  readonly element = make('div');

  private readonly job: JobPanel;
  private readonly start: HTMLButtonElement;
  private readonly links = make('div', { class: 'row' });
  private readonly frame = make('iframe', {
    class: 'certificate',
    title: 'Certificate',
    sandbox: '',
    referrerpolicy: 'no-referrer',
  });
  private readonly sheet = make('div', { class: 'sheet', hidden: true }, this.frame);
  private shownFiles = '';

  constructor(private readonly app: App) {
    this.job = new JobPanel(app);
    this.start = button(
      'Make the certificate',
      () => void app.begin('certificate', {}),
      { class: 'main' },
    );
    const about =
      'One page on how well this sensor measures: accuracy on loads the fit had not seen, cross-talk, noise, drift. It needs a wrench calibration.';
    const top = panel('Certificate', '', make('p', {}, about), make('div', { class: 'row' }, this.start));
    this.element.append(
      make('div', { class: 'column' }, top, this.job.element),
      make('div', { class: 'column' }, this.links, this.sheet),
    );
    new ResizeObserver(() => this.fit()).observe(this.sheet);
    app.link.on('job', (job) => this.show(job));
    app.link.on('state', (state) => this.show(state.job));
    app.link.on('hello', ({ can }) => {
      this.start.disabled = !can.jobs.includes('certificate');
    });
  }

  private show(job: Job | null): void {
    const mine = job?.verb === 'certificate' ? job : null;
    this.job.show(mine);
    if (mine?.state !== 'done' || !mine.result) return;
    const { result } = mine;
    const files = KINDS.map((kind) => [kind, textIn(result[kind])] as const).filter(([, path]) =>
      path.startsWith('/files/'),
    );
    if (JSON.stringify(files) === this.shownFiles) return;
    this.shownFiles = JSON.stringify(files);
    this.links.replaceChildren(...files.map(([kind, path]) => this.link(kind, path)));
    const page = files.find(([kind]) => kind === 'html')?.[1];
    // A frame carries no token; then the files are fetched by the buttons.
    present(this.sheet, page !== undefined && this.app.token === '');
    if (page && this.app.token === '') this.frame.src = page;
  }

  private fit(): void {
    const scale = Math.min(1, this.sheet.clientWidth / SHEET_PX) || 1;
    this.frame.style.setProperty('--sheet-scale', scale.toFixed(4));
  }

  private link(kind: string, path: string): HTMLElement {
    const words = kind.toUpperCase();
    if (this.app.token === '')
      return make('a', { class: 'button', href: path, target: '_blank', rel: 'noopener' }, words);
    return button(words, () => void this.fetch(path));
  }

  private async fetch(path: string): Promise<void> {
    try {
      const url = URL.createObjectURL(await fetchFile(path, this.app.token));
      make('a', { href: url, download: path.split('/').at(-1) ?? 'certificate' }).click();
      setTimeout(() => URL.revokeObjectURL(url), 60_000);
    } catch (failure) {
      this.app.tell(failure instanceof Error ? failure.message : String(failure), 'error');
    }
  }
}
