// The page's end of the worker that tracks.
import type { SensorInfo } from './core';
import type { FromWorker, SensorFiles, ToWorker } from './messages';

type Answer = Extract<FromWorker, { kind: 'opened' | 'refused' | 'learned' }>;
export type News = Exclude<FromWorker, Answer | { kind: 'ready' | 'broken' | 'took' }>;

export class TrackerClient {
  /** The tracker is loaded; rejected with a line for people if it cannot be. */
  readonly ready: Promise<void>;
  /** Called when the worker can take the next bitmap. */
  onTook = (): void => {};

  private readonly worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'tracker' });
  private readonly waiting = new Map<number, (answer: Answer) => void>();
  private asked = 0;

  constructor(private readonly onNews: (news: News) => void) {
    this.ready = new Promise((done, failed) => {
      this.worker.addEventListener('message', (event: MessageEvent<FromWorker>) => {
        const message = event.data;
        if (message.kind === 'ready') done();
        else if (message.kind === 'broken') failed(new Error(message.text));
        else this.hear(message);
      });
      this.worker.addEventListener('error', (event) => {
        failed(new Error(event.message || 'its program cannot be fetched: reload the page'));
      });
    });
  }

  /** Rejected with the tracker's own line; the sensor before stays in force then. */
  async open(files: SensorFiles): Promise<SensorInfo> {
    const answer = await this.ask((id) => ({ kind: 'open', id, files }));
    if (answer.kind === 'opened') return answer.info;
    throw new Error(answer.kind === 'refused' ? answer.text : 'no answer');
  }

  /** What was learned at rest, as files of measured/. */
  async learned(): Promise<Record<string, string>> {
    const now = new Date();
    const two = (value: number): string => String(value).padStart(2, '0');
    const date = `${now.getFullYear()}-${two(now.getMonth() + 1)}-${two(now.getDate())}`;
    const answer = await this.ask((id) => ({ kind: 'learned', id, date }));
    if (answer.kind === 'learned') return answer.files;
    throw new Error(answer.kind === 'refused' ? answer.text : 'no answer');
  }

  send(message: ToWorker, transfer: Transferable[] = []): void {
    this.worker.postMessage(message, transfer);
  }

  private hear(message: Exclude<FromWorker, { kind: 'ready' | 'broken' }>): void {
    switch (message.kind) {
      case 'opened':
      case 'refused':
      case 'learned':
        this.waiting.get(message.id)?.(message);
        this.waiting.delete(message.id);
        return;
      case 'took':
        return this.onTook();
      default:
        this.onNews(message);
    }
  }

  private ask(message: (id: number) => ToWorker): Promise<Answer> {
    const id = ++this.asked;
    return new Promise((done) => {
      this.waiting.set(id, done);
      this.send(message(id));
    });
  }
}
