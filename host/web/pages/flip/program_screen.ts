// This screen for `tagwrench camera-timing`: it says when to flip, and hears when that was, by this page's clock.
import type { Patch } from './patch';
import { subprotocols } from '../common/token';

interface Order {
  type: string;
  number: number;
  white: boolean;
  delay_ms: number;
}

const LONGEST_DELAY_MS = 1000;

function orderFrom(data: unknown): Order | null {
  if (typeof data !== 'string') return null;
  try {
    const { type, number, white, delay_ms } = JSON.parse(data) as Partial<Order>;
    const delay = typeof delay_ms === 'number' ? Math.min(Math.max(delay_ms, 0), LONGEST_DELAY_MS) : 0;
    return { type: String(type), number: Number(number), white: white === true, delay_ms: delay };
  } catch {
    return null;
  }
}

export class ProgramScreen {
  private socket: WebSocket | null = null;
  private nextId = 1;
  private flips = 0;
  /** Why this is no screen any more, as far as this page knows. */
  private why = '';

  constructor(
    private readonly url: string,
    private readonly token: string,
    private readonly patch: Patch,
    private readonly say: (line: string) => void,
  ) {}

  /** Flips as it is told until it is over; resolves with one line that says why. */
  serve(): Promise<string> {
    return new Promise((done) => {
      const socket = new WebSocket(this.url, subprotocols(this.token));
      this.socket = socket;
      let open = false;
      socket.addEventListener('open', () => {
        open = true;
        this.ask('screen', {});
      });
      socket.addEventListener('message', ({ data }) => this.take(data));
      socket.addEventListener('close', () => {
        const end = open
          ? 'tagwrench camera-timing has ended; its terminal says what it measured'
          : 'tagwrench camera-timing does not answer: does it still wait for a screen? Open the address that it printed';
        done(this.why || end);
      });
    });
  }

  leave(): void {
    this.why ||= 'ended';
    this.ask('leave', {});
    this.socket?.close();
  }

  private ask(what: string, rest: Readonly<Record<string, number>>): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ id: this.nextId++, ask: what, ...rest }));
  }

  private take(data: unknown): void {
    const order = orderFrom(data);
    if (order?.type === 'time') this.ask('time', { number: order.number, page_ms: performance.now() });
    else if (order?.type === 'flip') void this.flip(order);
    else if (order?.type === 'answer') this.answered(data);
  }

  private async flip({ number, white, delay_ms }: Order): Promise<void> {
    const page_ms = await this.patch.flip(white, performance.now() + delay_ms);
    this.ask('flipped', { number, page_ms });
    this.say(`flip ${++this.flips}; any key ends it`);
  }

  private answered(data: unknown): void {
    const { ok, text } = JSON.parse(String(data)) as { ok?: unknown; text?: unknown };
    if (ok === true) return;
    this.why ||= String(text);
    this.socket?.close();
  }
}
