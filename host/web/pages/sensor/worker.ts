// Everything about tracking, away from the page: it reads the camera's pictures, runs the tracker and says what came out.
import { Core, type SensorInfo } from './core';
import type { FromWorker, SensorFiles, ToWorker } from './messages';
import { Newest } from './newest';
import { Arrival, Tracking } from './tracking';

function tell(message: FromWorker, transfer: Transferable[] = []): void {
  self.postMessage(message, { transfer });
}

const words = (error: unknown): string => (error instanceof Error ? error.message : String(error));

class TrackingWorker {
  private tracking: Tracking | null = null;
  private pictures = false;
  private finding = false;
  /** Counts streams, so that an old one's end is not taken for the new one's. */
  private stream = 0;
  private readonly newest = new Newest<Arrival>((arrival) => this.take(arrival));

  constructor(private readonly core: Core) {}

  hear(message: ToWorker): void {
    switch (message.kind) {
      case 'open':
        return this.open(message.id, message.files);
      case 'stream':
        void this.follow(message.readable);
        return;
      case 'bitmap':
        this.newest.put(new Arrival(message.bitmap, message.time_us));
        return;
      case 'stop':
        this.stream++;
        this.newest.clear();
        return;
      case 'zero':
        return this.core.zero();
      case 'learned':
        return this.sayLearned(message.id, message.date);
      case 'pictures':
        this.pictures = message.on;
        if (this.tracking) this.tracking.picturesWanted = message.on;
    }
  }

  /** A sensor that cannot be used leaves the one before in force. */
  private open(id: number, files: SensorFiles): void {
    let info: SensorInfo;
    try {
      info = this.core.open(files.yaml, files.name, files.calibration, files.appearance, files.measured);
    } catch (error) {
      tell({ kind: 'refused', id, text: words(error) });
      return;
    }
    this.tracking = new Tracking(this.core, info, tell);
    this.tracking.picturesWanted = this.pictures;
    tell({ kind: 'opened', id, info });
  }

  private async take(arrival: Arrival): Promise<void> {
    if (this.tracking) await this.tracking.take(arrival);
    else arrival.close();
    if (arrival.picture instanceof ImageBitmap) tell({ kind: 'took' });
    if (this.core.needsFinder && !this.finding) void this.find();
  }

  /** What finds tags anew is large: it is fetched when it is needed for the first time. */
  private async find(): Promise<void> {
    this.finding = true;
    tell({ kind: 'finder', state: 'loading', text: '' });
    try {
      const { loadFinder } = await import('./finder');
      this.core.setFinder(await loadFinder());
      tell({ kind: 'finder', state: 'ready', text: '' });
    } catch (error) {
      tell({ kind: 'finder', state: 'failed', text: words(error) });
    }
  }

  private async follow(readable: ReadableStream<VideoFrame>): Promise<void> {
    const mine = ++this.stream;
    this.tracking?.newFeed();
    const reader = readable.getReader();
    try {
      for (;;) {
        const { value, done } = await reader.read();
        if (done) break;
        if (mine !== this.stream) {
          value.close();
          await reader.cancel();
          return;
        }
        this.newest.put(new Arrival(value, value.timestamp));
      }
    } catch (error) {
      tell({ kind: 'unreadable', text: `the camera's pictures cannot be read: ${words(error)}` });
    }
    if (mine === this.stream) tell({ kind: 'ended' });
  }

  private sayLearned(id: number, date: string): void {
    try {
      tell({ kind: 'learned', id, files: this.core.learned(date) });
    } catch (error) {
      tell({ kind: 'refused', id, text: words(error) });
    }
  }
}

const early: ToWorker[] = [];
let hear = (message: ToWorker): void => {
  early.push(message);
};
self.addEventListener('message', (event: MessageEvent<ToWorker>) => hear(event.data));

try {
  const worker = new TrackingWorker(await Core.load());
  hear = (message) => worker.hear(message);
  early.forEach(hear);
  tell({ kind: 'ready' });
} catch (error) {
  tell({ kind: 'broken', text: words(error) });
}
