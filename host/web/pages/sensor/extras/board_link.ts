// Talks to the board through WebSerial: says hello until it answers, sets it up, keeps its light on, hands on what it reports.
import { type BoardNews, Kind, PROTOCOL_MAJOR, configure, helloRequest, readNews, steadyLight, tare } from './board_messages';
import { FrameReader, writeFrame } from './board_frame';

const BAUD = 500_000;
const TICK_MS = 250;
const HOST_TIMEOUT_MS = 5000;
const STATUS_MS = 1000;
const TARE_CONVERSIONS = 20;

export class BoardLink {
  private readonly session = crypto.getRandomValues(new Uint32Array(1))[0] ?? 1;
  private readonly reader = new FrameReader();
  private writer: WritableStreamDefaultWriter<Uint8Array> | null = null;
  private input: ReadableStreamDefaultReader<Uint8Array> | null = null;
  private timer = 0;
  private sequence = 0;
  private ticks = 0;
  private cells = 0;
  private light_permille: number | null = null;
  private greeted = false;
  private configured = false;

  constructor(
    private readonly port: SerialPort,
    private readonly onNews: (news: BoardNews) => void,
    private readonly onEnd: (why: string) => void,
  ) {}

  async open(): Promise<void> {
    await this.port.open({ baudRate: BAUD });
    this.writer = this.port.writable?.getWriter() ?? null;
    this.timer = window.setInterval(() => this.tick(), TICK_MS);
    void this.listen();
    this.tick();
  }

  async close(): Promise<void> {
    window.clearInterval(this.timer);
    try {
      await this.input?.cancel();
      this.writer?.releaseLock();
      await this.port.close();
    } catch {
      // It was unplugged.
    }
  }

  setLight(permille: number): void {
    this.light_permille = Math.round(Math.min(Math.max(permille, 0), 1000));
    this.sendLight();
  }

  tareAll(): void {
    if (this.cells > 0) this.send(Kind.tare, tare((1 << this.cells) - 1, TARE_CONVERSIONS));
  }

  private async listen(): Promise<void> {
    let why = 'the board is unplugged';
    try {
      this.input = this.port.readable?.getReader() ?? null;
      for (;;) {
        const { value, done } = (await this.input?.read()) ?? { value: undefined, done: true };
        if (done) break;
        for (const { kind, message } of this.reader.take(value)) {
          const news = readNews(kind, message);
          if (news) this.take(news);
        }
      }
    } catch (error) {
      why = `the board is gone: ${error instanceof Error ? error.message : String(error)}`;
    }
    this.input?.releaseLock();
    window.clearInterval(this.timer);
    this.onEnd(why);
  }

  private take(news: BoardNews): void {
    // A board that started anew, or that has another host now, is greeted again.
    if (news.kind === 'status' && news.session !== this.session) this.greeted = this.configured = false;
    if (news.kind === 'hello') this.greeted = news.session === this.session && news.major === PROTOCOL_MAJOR;
    if (news.kind === 'capabilities') this.cells = news.cells;
    if (news.kind === 'answer' && news.request === Kind.configure) this.configured = news.result === 0;
    this.onNews(news);
  }

  private tick(): void {
    const everySecond = this.ticks++ % (1000 / TICK_MS) === 0;
    if (!this.greeted) return this.send(Kind.helloRequest, helloRequest(this.session));
    if (!this.configured && this.cells > 0) this.send(Kind.configure, configure(this.cells, HOST_TIMEOUT_MS, STATUS_MS));
    if (!everySecond) return;
    this.send(Kind.timeRequest, new Uint8Array(0)); // a sign of life
    this.sendLight();
  }

  private sendLight(): void {
    if (this.greeted && this.light_permille !== null) this.send(Kind.led, steadyLight(this.light_permille));
  }

  private send(kind: number, message: Uint8Array): void {
    const frame = writeFrame({ kind, sequence: this.sequence++, message });
    this.writer?.write(frame).catch(() => undefined); // the reader notices, and says so
  }
}
