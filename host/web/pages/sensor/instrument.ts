// The instrument: camera, tracker and everything that shows what they say, wired together.
import { button, make, panel } from '../common/elements';
import type { PlatformView } from '../common/platform_view';
import { Readings } from '../common/readings';
import { Traces } from '../common/traces';
import { Camera, type CameraState, type CameraRequest } from './camera';
import { CameraPanel } from './camera_panel';
import exampleYaml from './example.yaml?raw';
import { ExtrasPanel } from './extras/extras_panel';
import { CameraFeed, hasVideoFrames } from './feed';
import type { Feed, SensorFiles } from './messages';
import { PictureView } from './picture_view';
import { RecordPanel } from './record_panel';
import { SensorPanel } from './sensor_panel';
import { StatusPanel } from './status_panel';
import { storeFiles, storeRequest, storedFiles, storedRequest } from './storage';
import { TabLock } from './tab_lock';
import { type News, TrackerClient } from './tracker_client';

const EXAMPLE: SensorFiles = { name: 'published sensor', yaml: exampleYaml };
const USUAL: CameraRequest = { deviceId: '', width: 640, height: 480, rate_hz: 60 };
/** Before anything was measured. */
const WELCOME =
  'The camera looks at the tags under the platform. Start, allow the camera, then hands off for a second. ' +
  'Pictures stay in this computer.';
const SETS_MIRRORED = /set\s+camera\.mirrored:\s*(true|false)/;

export class Instrument {
  private readonly client = new TrackerClient((news) => this.hear(news));
  private readonly feed = new CameraFeed(this.client);
  private readonly camera = new Camera((state) => this.cameraBecame(state));
  private readonly lock = new TabLock(() => this.lockLost());
  private readonly status: StatusPanel;
  private readonly picture: PictureView;
  private readonly traces: Traces;
  private readonly readings: Readings;
  /** Loaded after all else: it is large. */
  private platform: PlatformView | null = null;
  private readonly platformHolder: HTMLElement;
  private readonly recording: RecordPanel;
  private readonly sensor: SensorPanel;
  private readonly cameraPanel: CameraPanel;
  private readonly takeOver: HTMLButtonElement;
  private ranges: [readonly number[], readonly number[]] = [[], []];
  private size: readonly [number, number] = [640, 480];
  private sizeTrouble = '';
  private mirrored = false;
  /** The hint is the one for people who have not started yet. */
  private welcoming = false;

  constructor(root: HTMLElement) {
    this.takeOver = button('Measure in this tab', () => void this.lock.take(true).then(() => this.start()), { hidden: true, class: 'main' });
    const view = panel('Picture', 'picture-panel');
    this.picture = new PictureView(view);
    const side = make('div', { class: 'side' }, view);
    this.cameraPanel = new CameraPanel(side, storedRequest(USUAL), { onStart: (request) => void this.start(request), onStop: () => this.stop() });
    const status = panel('State', 'state-panel');
    const actions = [this.cameraPanel.startButton, this.takeOver];
    this.status = new StatusPanel(status, () => void this.sensor.setMirrored(this.mirrored), actions);
    const traces = panel('Forces and torques', 'traces-panel');
    const centre = make('div', { class: 'centre' }, traces);
    const readings = panel('Now', 'readings-panel');
    this.platformHolder = panel('Platform', 'platform-panel');
    const right = make('div', { class: 'right' }, readings, this.platformHolder);
    this.recording = new RecordPanel(centre);
    this.sensor = new SensorPanel(centre, {
      onFiles: (files) => this.use(files, true),
      onExample: () => this.useExample(),
      learned: () => this.client.learned(),
    });
    new ExtrasPanel(side);
    root.append(status, side, centre, right);
    this.traces = new Traces(traces);
    this.readings = new Readings(readings, { onZero: () => this.client.send({ kind: 'zero' }) });
    document.addEventListener('keydown', (event) => {
      const typing = event.target instanceof HTMLElement && event.target.closest('input, select, textarea');
      if (event.key === '0' && !typing && !event.ctrlKey && !event.metaKey) this.client.send({ kind: 'zero' });
    });
    document.addEventListener('visibilitychange', () => this.visibility());
  }

  /** The tracker, the sensor of last time, and the camera if it was allowed before. */
  async begin(): Promise<void> {
    this.status.say('loading the tracker');
    try {
      await this.client.ready;
    } catch (error) {
      this.status.say('the tracker cannot be loaded');
      this.status.setTrouble(error instanceof Error ? error.message : String(error));
      return;
    }
    await this.useStored();
    this.cameraPanel.offerCameras(await this.camera.list());
    this.client.send({ kind: 'pictures', on: true });
    if (await Instrument.cameraAllowed()) await this.start();
    else this.invite();
    const { PlatformView } = await import('../common/platform_view');
    this.platform = new PlatformView(this.platformHolder);
    this.platform.setRange(...this.ranges);
  }

  private invite(): void {
    this.status.say('press Start');
    this.status.setHint(WELCOME, false);
    this.welcoming = true;
  }

  private static async cameraAllowed(): Promise<boolean> {
    try {
      return (await navigator.permissions.query({ name: 'camera' as PermissionName })).state === 'granted';
    } catch {
      return false; // a browser that does not tell
    }
  }

  private async useStored(): Promise<void> {
    const stored = await storedFiles();
    try {
      await this.use(stored ?? EXAMPLE, false);
    } catch {
      await this.use(EXAMPLE, false); // of an older version of this page
    }
  }

  private async useExample(): Promise<void> {
    await this.use(EXAMPLE, false);
    await storeFiles(null);
  }

  private async use(files: SensorFiles, remember: boolean): Promise<void> {
    const info = await this.client.open(files);
    if (remember) await storeFiles(files); // before the page says that it is in force
    this.status.setHint('', false);
    this.traces.clear();
    this.traces.setRange(info.range_n, info.range_nm);
    this.readings.setRange(info.range_n, info.range_nm);
    this.ranges = [info.range_n, info.range_nm];
    this.platform?.setRange(...this.ranges);
    this.size = [info.width, info.height];
    this.sensor.show(files, info);
    this.cameraPanel.setSensorSize(info.width, info.height);
  }

  private async start(request: CameraRequest = storedRequest(USUAL)): Promise<void> {
    if (!(await this.lock.take())) {
      this.status.say('another tab of this browser measures already');
      this.takeOver.hidden = false;
      return;
    }
    this.takeOver.hidden = true;
    storeRequest(request);
    if (this.welcoming) this.status.setHint('', false);
    this.welcoming = false;
    await this.camera.open(request);
  }

  private stop(): void {
    this.halt('stopped');
  }

  /** Nothing is measured: what was the latest number is none of now. */
  private halt(words: string): void {
    this.camera.close();
    this.status.say(words);
    this.picture.clear();
  }

  private lockLost(): void {
    this.halt('another tab has taken over');
    this.takeOver.hidden = false;
  }

  private cameraBecame(state: CameraState): void {
    this.cameraPanel.show(state);
    this.status.setTrouble('');
    if (state.name === 'open') {
      this.feed.start(state.track);
      this.status.say('waiting for pictures');
      void this.camera.list().then((devices) => this.cameraPanel.offerCameras(devices));
      return;
    }
    this.feed.stop();
    this.readings.forget();
    this.platform?.forget();
    if (state.name === 'opening') this.status.say('opening the camera');
    if (state.name === 'gone') {
      this.status.say('the camera is gone');
      this.status.setTrouble(`${state.label || 'It'} was unplugged or taken away: plug it in again, it is opened by itself.`);
    }
    if (state.name === 'failed') {
      this.status.say(state.trouble.title);
      this.status.setTrouble(state.trouble.advice);
    }
    if (state.name !== 'closed') this.picture.clear();
  }

  private hear(news: News): void {
    const measured = news.kind === 'sample' || news.kind === 'picture';
    if (measured && this.camera.state.name !== 'open') return; // was on its way when the camera closed
    switch (news.kind) {
      case 'sample':
        this.status.show(news.sample, news.feed);
        this.traces.push([news.sample]);
        this.readings.show(news.sample);
        this.platform?.show(news.sample);
        this.recording.add(news.sample);
        this.checkSize(news.feed);
        return;
      case 'picture':
        return this.picture.show(news);
      case 'hint': {
        const says = SETS_MIRRORED.exec(news.text);
        this.mirrored = says?.[1] === 'true';
        return this.status.setHint(news.text, says !== null);
      }
      case 'finder':
        this.status.setLooking(news.state === 'loading' ? 'fetching the tag finder (11 MB, once)' : '');
        if (news.state === 'failed') this.status.setTrouble(`The tag finder cannot be fetched (${news.text}): reload the page.`);
        return;
      case 'unreadable':
        return this.status.setTrouble(news.text);
      case 'ended':
        return;
    }
  }

  /** A camera that delivers another size than the sensor's: its numbers would mean nothing. */
  private checkSize({ width, height }: Feed): void {
    const [wide, high] = this.size;
    let text = '';
    if (width === high && height === wide && width !== height) text = 'The picture stands upright: turn the phone on its side.';
    else if (width !== wide || height !== high) {
      text = `The camera delivers ${width}×${height}, but the sensor is described for ${wide}×${high}: choose that size, or change the sensor.`;
    }
    if (text !== this.sizeTrouble) this.status.setTrouble((this.sizeTrouble = text));
  }

  private visibility(): void {
    if (this.camera.state.name !== 'open' || hasVideoFrames()) return;
    this.status.say(document.hidden ? 'paused while the tab is hidden' : 'waiting for pictures');
  }
}
