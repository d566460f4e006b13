// Choice of camera and mode, start and stop, and what the camera lets a page set.
import { button, field, make, panel, say } from '../common/elements';
import { Camera, type CameraState, type CameraRequest } from './camera';
import { CameraControls } from './camera_controls';
import { storeRequest } from './storage';

export interface CameraPanelOptions {
  onStart: (request: CameraRequest) => void;
  onStop: () => void;
}

const option = (value: string, text: string): HTMLOptionElement => make('option', { value }, text);

export class CameraPanel {
  /** Starts and stops; for whoever shows it. */
  readonly startButton: HTMLButtonElement;
  private readonly cameras = make('select');
  private readonly sizes = make('select');
  private readonly rates = make('select');
  private readonly words = make('p', { class: 'hint', role: 'status' });
  private readonly controls: CameraControls;
  private open = false;
  private track: MediaStreamTrack | null = null;
  private own: readonly [number, number] = [640, 480];

  constructor(
    parent: HTMLElement,
    private request: CameraRequest,
    private readonly options: CameraPanelOptions,
  ) {
    this.startButton = button('Start', () => (this.open ? options.onStop() : options.onStart(this.request)), { class: 'main' });
    const settings = make('div');
    this.controls = new CameraControls(settings);
    parent.append(panel(
      'Camera', 'camera-panel',
      field('Camera', this.cameras), field('Size', this.sizes), field('Rate, Hz', this.rates), this.words, settings,
    ));
    this.cameras.addEventListener('change', () => this.choose({ deviceId: this.cameras.value }));
    this.sizes.addEventListener('change', () => {
      const [width = 640, height = 480] = this.sizes.value.split('x').map(Number);
      this.choose({ width, height });
    });
    this.rates.addEventListener('change', () => this.choose({ rate_hz: Number(this.rates.value) }));
    this.offerModes();
    this.offerCameras([]);
  }

  /** The pictures that the sensor is described for; chosen if others were. */
  setSensorSize(width: number, height: number): void {
    this.own = [width, height];
    if (this.request.width !== width || this.request.height !== height) this.choose({ width, height });
    this.offerModes();
  }

  offerCameras(devices: readonly MediaDeviceInfo[]): void {
    const named = devices.filter((device) => device.deviceId !== '');
    const options = named.map((device, i) => option(device.deviceId, device.label || `camera ${i + 1}`));
    const present = this.track?.getSettings().deviceId ?? this.request.deviceId;
    if (!this.track || options.length === 0) options.unshift(option('', 'the rear or the first one'));
    this.cameras.replaceChildren(...options);
    this.cameras.value = named.some((device) => device.deviceId === present) ? present : (options[0]?.value ?? '');
  }

  show(state: CameraState): void {
    this.open = state.name === 'open' || state.name === 'opening' || state.name === 'gone';
    this.startButton.textContent = this.open ? 'Stop' : 'Start';
    this.startButton.classList.toggle('main', !this.open);
    this.track = state.name === 'open' ? state.track : null;
    this.controls.use(this.track);
    if (state.name === 'open') this.offerModes();
    say(this.words, this.line(state));
  }

  private line(state: CameraState): string {
    if (state.name === 'opening') return 'Opening; the browser may ask for the camera.';
    if (state.name !== 'open') return '';
    const { width, height, rate_hz } = state.mode;
    return `${state.track.label || 'Camera'}: ${width}×${height} at ${rate_hz.toFixed(rate_hz % 1 ? 1 : 0)} Hz`;
  }

  private offerModes(): void {
    const size = (width: number, height: number): string => `${width}x${height}`;
    const sizes = Camera.sizes(this.track, this.own);
    this.sizes.replaceChildren(...sizes.map(([width, height]) => {
      const own = width === this.own[0] && height === this.own[1];
      return option(size(width, height), `${width}×${height}${own ? ' (sensor)' : ''}`);
    }));
    this.sizes.value = size(this.request.width, this.request.height);
    const rates = Camera.rates(this.track);
    if (!rates.includes(this.request.rate_hz)) rates.push(this.request.rate_hz);
    rates.sort((a, b) => a - b);
    this.rates.replaceChildren(...rates.map((rate) => option(String(rate), `${rate}`)));
    this.rates.value = String(this.request.rate_hz);
  }

  private choose(part: Partial<CameraRequest>): void {
    this.request = { ...this.request, ...part };
    storeRequest(this.request);
    if (this.open) this.options.onStart(this.request);
  }
}
