// What the sensor feels now: traces, numbers, the platform, the picture, and how well all of it runs.
import './live.css';
import { button, make, panel, say } from '../../common/elements';
import { PlatformView } from '../../common/platform_view';
import { Readings } from '../../common/readings';
import { type Sample, figure } from '../../common/sample';
import { Traces } from '../../common/traces';
import { CameraPicture } from '../camera_picture';
import type { BridgeState, Hello } from '../protocol';
import { Quality } from '../quality';
import type { App, View } from '../view';

const FACTS = ['rate', 'latency', 'worst 1 %', 'jitter', 'lost frames', 'tags held'] as const;
type Fact = (typeof FACTS)[number];

export class LiveView implements View {
  readonly name = 'live';
  readonly title = 'Live';
  readonly element = make('div');

  private readonly traces: Traces;
  private readonly readings: Readings;
  private readonly platform: PlatformView;
  private readonly picture: CameraPicture;
  private readonly quality = new Quality();
  private readonly facts = new Map<Fact, HTMLElement>();
  private readonly clients = make('p', { class: 'clients' }, 'no program reads the device');
  private readonly origin = make('p', { class: 'origin hint' });
  private readonly pauseButton: HTMLButtonElement;
  private paused = false;
  private pageLost = 0;

  constructor(private readonly app: App) {
    const tracesPanel = panel('Six axes, last 20 s, band ±2σ', 'panel-traces');
    this.traces = new Traces(tracesPanel);
    this.pauseButton = button('Pause', () => this.pause(), {
      class: 'quiet',
      'aria-pressed': 'false',
      title: 'Hold the traces still (key p)',
    });
    tracesPanel.firstElementChild?.append(
      this.pauseButton,
      button('Clear', () => this.traces.clear(), { class: 'quiet' }),
    );
    const numbers = panel('Force and torque on the platform', 'panel-numbers');
    this.readings = new Readings(numbers, { onZero: () => void app.request('zero') });
    const platform = panel('Platform', 'panel-platform');
    this.platform = new PlatformView(platform);
    this.picture = new CameraPicture(app.link, 'camera picture');
    const camera = panel('Camera', 'panel-camera', this.picture.element, this.quality.element);
    const run = panel('Bridge', 'panel-run', this.makeFacts(), this.origin, this.clients);
    const column = make('div', { class: 'column' }, numbers, platform);
    this.element.append(tracesPanel, column, make('div', { class: 'column' }, camera, run));
    app.link.on('samples', ({ samples, lost }) => this.push(samples, lost));
    app.link.on('state', (state) => this.showState(state));
    app.link.on('hello', (hello) => this.showHello(hello));
    document.addEventListener('keydown', (event) => {
      const typing = event.target instanceof HTMLElement && event.target.matches('input, select, textarea');
      if (event.key === 'p' && !typing && !event.ctrlKey && this.element.isConnected) this.pause();
    });
  }

  shown(on: boolean): void {
    this.picture.shown(on);
  }

  private makeFacts(): HTMLElement {
    const list = make('dl', { class: 'facts' });
    for (const fact of FACTS) {
      const value = make('dd', { class: 'number' }, '–');
      this.facts.set(fact, value);
      list.append(make('dt', {}, fact), value);
    }
    return list;
  }

  private push(samples: readonly Sample[], lost: number): void {
    this.pageLost += lost;
    this.traces.push(samples);
    for (const sample of samples) this.readings.show(sample);
    const newest = samples.at(-1);
    if (!newest) return;
    this.platform.show(newest);
    if (newest.tags_held !== undefined) this.fact('tags held', String(newest.tags_held));
  }

  private pause(): void {
    this.paused = !this.paused;
    this.traces.pause(this.paused);
    say(this.pauseButton, this.paused ? 'Go on' : 'Pause');
    this.pauseButton.setAttribute('aria-pressed', String(this.paused));
  }

  private fact(name: Fact, text: string): void {
    const element = this.facts.get(name);
    if (element) say(element, text);
  }

  private showState(state: BridgeState): void {
    if (!state.running) for (const part of [this.readings, this.platform]) part.forget();
    this.fact('rate', `${figure(state.rate_hz, 1)} Hz`);
    this.fact('latency', `${figure(state.latency_us.median / 1e3, 2)} ms`);
    this.fact('worst 1 %', `${figure(state.latency_us.p99 / 1e3, 2)} ms`);
    this.fact('jitter', `${figure(state.jitter_us / 1e3, 2)} ms`);
    this.fact(
      'lost frames',
      `${state.dropped + state.skipped} of ${state.frames + state.dropped + state.skipped}`,
    );
    this.quality.show(state.image);
    const readers = state.clients.map((client) => `${client.name} (${client.by})`);
    say(this.clients, readers.length > 0 ? `read by ${readers.join(', ')}` : 'no program reads the device');
    const behind = this.pageLost > 0 ? `; this page missed ${this.pageLost} samples` : '';
    const hello = this.app.link.hello;
    if (hello) say(this.origin, `${hello.source}${behind}`);
  }

  private showHello(hello: Hello): void {
    for (const part of [this.traces, this.readings, this.platform])
      part.setRange(hello.range_n, hello.range_nm);
  }
}
