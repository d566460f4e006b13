// The connection to the bridge: comes back by itself, tells what arrives, asks and awaits answers.
import { sampleFrom, type Sample } from '../common/sample';
import {
  type Answer,
  type BridgeState,
  type Hello,
  type Job,
  type Picture,
  PROTOCOL,
  answerFrom,
  helloFrom,
  jobFrom,
  listIn,
  pictureFrom,
  said,
  stateFrom,
  textIn,
} from './protocol';
import { subprotocols } from '../common/token';

export type LinkState =
  | { kind: 'connecting' }
  | { kind: 'open' }
  | { kind: 'waiting'; since: Date; refused: boolean }
  | { kind: 'older' };

interface Events {
  link: LinkState;
  hello: Hello;
  state: BridgeState;
  samples: { samples: readonly Sample[]; lost: number };
  job: Job | null;
  line: string;
  picture: Picture;
}

interface Pending {
  resolve: (answer: Answer) => void;
  timer: ReturnType<typeof setTimeout>;
}

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 5000;
const SILENCE_MS = 6000;
const ANSWER_MS = 15000;
const MOST_PENDING = 64;
const LONGEST_ASK = 20000;
/** The bridge closes on more than 40 a second. */
const MOST_ASKS_A_SECOND = 30;

export class Link {
  hello: Hello | null = null;
  state: BridgeState | null = null;

  private readonly listeners: { [Name in keyof Events]: Set<(event: Events[Name]) => void> } = {
    link: new Set(),
    hello: new Set(),
    state: new Set(),
    samples: new Set(),
    job: new Set(),
    line: new Set(),
    picture: new Set(),
  };
  private readonly pending = new Map<number, Pending>();
  private readonly asked_ms: number[] = [];
  private socket: WebSocket | null = null;
  private nextId = 1;
  private wait_ms = FIRST_WAIT_MS;
  private since: Date | null = null;
  private silence: ReturnType<typeof setTimeout> | undefined;
  /** Of the present socket. */
  private opened = false;
  /** Said hello to, on the present socket. */
  private greeted = false;
  private readonly wanting = new Set<object>();

  constructor(
    private readonly url: string,
    private readonly token: string,
  ) {
    addEventListener('online', () => {
      this.wait_ms = FIRST_WAIT_MS;
    });
  }

  on<Name extends keyof Events>(name: Name, listener: (event: Events[Name]) => void): void {
    this.listeners[name].add(listener);
  }

  connect(): void {
    this.tell('link', { kind: 'connecting' });
    this.opened = false;
    const socket = new WebSocket(this.url, subprotocols(this.token));
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    socket.addEventListener('open', () => this.onOpen());
    socket.addEventListener('message', (event) => this.onMessage(event.data));
    socket.addEventListener('close', () => this.onClose());
    this.listen();
  }

  /** Every ask is answered: by the bridge, or by what stands in its way. Never rejects. */
  ask(what: string, extra: Readonly<Record<string, unknown>> = {}): Promise<Answer> {
    const id = this.nextId++;
    const refuse = (text: string): Promise<Answer> => Promise.resolve({ id, ok: false, text, data: null });
    if (this.socket?.readyState !== WebSocket.OPEN)
      return refuse('not connected to the bridge; try again once it is back');
    if (this.pending.size >= MOST_PENDING)
      return refuse('the bridge has not answered for a while; wait a moment');
    const text = JSON.stringify({ id, ask: what, ...extra });
    if (new TextEncoder().encode(text).length > LONGEST_ASK)
      return refuse('that is too long for the bridge (20,000 bytes)');
    if (!this.mayAsk()) return refuse('too many requests at once; wait a second');
    this.socket.send(text);
    return new Promise((resolve) => {
      const timer = setTimeout(
        () => this.settle({ id, ok: false, text: 'the bridge does not answer; is it busy?', data: null }),
        ANSWER_MS,
      );
      this.pending.set(id, { resolve, timer });
    });
  }

  /** Pictures come while anybody wants them; asked again after each reconnect. */
  wantPictures(who: object, on: boolean): void {
    const before = this.wanting.size > 0;
    if (on) this.wanting.add(who);
    else this.wanting.delete(who);
    if (before !== this.wanting.size > 0 && this.greeted)
      void this.ask('pictures', { on: this.wanting.size > 0 });
  }

  private mayAsk(): boolean {
    const now = performance.now();
    while ((this.asked_ms[0] ?? now) < now - 1000) this.asked_ms.shift();
    if (this.asked_ms.length >= MOST_ASKS_A_SECOND) return false;
    this.asked_ms.push(now);
    return true;
  }

  private onOpen(): void {
    this.opened = true;
    this.listen();
  }

  private onClose(): void {
    clearTimeout(this.silence);
    const opened = this.opened;
    this.socket = null;
    this.opened = this.greeted = false;
    for (const id of [...this.pending.keys()])
      this.settle({ id, ok: false, text: 'the connection to the bridge was lost', data: null });
    if (this.hello && this.hello.protocol !== PROTOCOL) return;
    this.since ??= new Date();
    void this.retry(this.since, opened);
  }

  private async retry(since: Date, opened: boolean): Promise<void> {
    this.tell('link', { kind: 'waiting', since, refused: !opened && (await Link.answers()) });
    setTimeout(() => this.connect(), this.wait_ms * (0.8 + 0.4 * Math.random()));
    this.wait_ms = Math.min(LONGEST_WAIT_MS, this.wait_ms * 2);
  }

  /**
   * A browser does not say why a WebSocket was refused. If pages are still served, it was not for want of
   * a bridge.
   */
  private static async answers(): Promise<boolean> {
    try {
      return (await fetch(location.pathname, { cache: 'no-store', signal: AbortSignal.timeout(2000) })).ok;
    } catch {
      return false;
    }
  }

  /** A bridge says something twice a second. One that is silent is gone, however open the socket looks. */
  private listen(): void {
    clearTimeout(this.silence);
    this.silence = setTimeout(() => this.socket?.close(), SILENCE_MS);
  }

  private onMessage(data: unknown): void {
    this.listen();
    if (data instanceof ArrayBuffer) {
      const picture = pictureFrom(data);
      if (picture) this.tell('picture', picture);
      return;
    }
    let message: Record<string, unknown>;
    try {
      message = said(JSON.parse(String(data)));
    } catch {
      return;
    }
    this.hear(message);
  }

  private hear(message: Record<string, unknown>): void {
    switch (message.type) {
      case 'hello':
        return this.hearHello(helloFrom(message));
      case 'samples':
        return this.tell('samples', {
          samples: listIn(message.samples, sampleFrom).filter((sample) => sample !== null),
          lost: typeof message.lost === 'number' ? message.lost : 0,
        });
      case 'state':
        this.state = stateFrom(message);
        return this.tell('state', this.state);
      case 'job': {
        const job = jobFrom(message.job);
        if (this.state) this.state = { ...this.state, job };
        return this.tell('job', job);
      }
      case 'say':
        return this.tell('line', textIn(message.line));
      case 'answer':
        return this.settle(answerFrom(message));
      default:
        return; // of a newer bridge
    }
  }

  private hearHello(hello: Hello): void {
    const again = !this.greeted;
    this.hello = hello;
    this.greeted = true;
    if (hello.protocol !== PROTOCOL) {
      this.tell('link', { kind: 'older' });
      this.socket?.close();
      return;
    }
    this.wait_ms = FIRST_WAIT_MS;
    this.since = null;
    this.tell('link', { kind: 'open' });
    this.tell('hello', hello);
    if (again && this.wanting.size > 0) void this.ask('pictures', { on: true });
  }

  private settle(answer: Answer): void {
    const pending = this.pending.get(answer.id);
    if (!pending) return;
    this.pending.delete(answer.id);
    clearTimeout(pending.timer);
    pending.resolve(answer);
  }

  private tell<Name extends keyof Events>(name: Name, event: Events[Name]): void {
    for (const listener of this.listeners[name]) listener(event);
  }
}
