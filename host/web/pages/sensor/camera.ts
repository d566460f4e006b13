// The camera: choice, mode, opening, and coming back after it was unplugged.
import { type Trouble, cameraTrouble } from './checks';

export interface CameraRequest {
  /** Empty: the rear camera of a phone, else the browser's first. */
  deviceId: string;
  width: number;
  height: number;
  rate_hz: number;
}

export interface CameraMode {
  width: number;
  height: number;
  rate_hz: number;
}

export type CameraState =
  | { name: 'closed' }
  | { name: 'opening' }
  | { name: 'open'; track: MediaStreamTrack; mode: CameraMode }
  | { name: 'gone'; label: string }
  | { name: 'failed'; trouble: Trouble; waiting: boolean };

const SIZES: readonly (readonly [number, number])[] = [
  [320, 240], [640, 360], [640, 480], [800, 600], [1280, 720], [1280, 960], [1920, 1080],
];
const RATES: readonly number[] = [15, 25, 30, 50, 60, 90, 120];

export class Camera {
  state: CameraState = { name: 'closed' };
  private request: CameraRequest | null = null;
  private turn = 0;

  constructor(private readonly onState: (state: CameraState) => void) {
    navigator.mediaDevices.addEventListener('devicechange', () => void this.devicesChanged());
  }

  /** Labels are empty until a camera was allowed. */
  async list(): Promise<MediaDeviceInfo[]> {
    const all = await navigator.mediaDevices.enumerateDevices();
    return all.filter((device) => device.kind === 'videoinput');
  }

  async open(request: CameraRequest): Promise<void> {
    this.close();
    this.request = request;
    const turn = this.turn;
    this.become({ name: 'opening' });
    let stream: MediaStream;
    try {
      stream = await navigator.mediaDevices.getUserMedia({ audio: false, video: Camera.constraints(request) });
    } catch (error) {
      if (turn !== this.turn) return;
      const missing = error instanceof Error && error.name === 'NotFoundError';
      this.become({ name: 'failed', trouble: cameraTrouble(error), waiting: missing });
      return;
    }
    const track = stream.getVideoTracks()[0];
    if (!track || turn !== this.turn) {
      stream.getTracks().forEach((each) => each.stop());
      return;
    }
    track.addEventListener('ended', () => this.ended(turn, track.label));
    const { width = 0, height = 0, frameRate = 0, deviceId = request.deviceId } = track.getSettings();
    this.request = { ...request, deviceId }; // after it was unplugged, this one is waited for and no other
    this.become({ name: 'open', track, mode: { width, height, rate_hz: frameRate } });
  }

  close(): void {
    this.turn++;
    if (this.state.name === 'open') this.state.track.stop();
    this.become({ name: 'closed' });
  }

  /** Sizes that are worth offering: the sensor's own, the present one, and usual ones that the camera may have. */
  static sizes(track: MediaStreamTrack | null, own: readonly [number, number]): (readonly [number, number])[] {
    const capabilities = track?.getCapabilities?.() ?? {};
    const widest = capabilities.width?.max ?? 1920;
    const highest = capabilities.height?.max ?? 1080;
    const usual = SIZES.filter(([width, height]) => width <= widest && height <= highest);
    return usual.some(([width, height]) => width === own[0] && height === own[1]) ? usual : [own, ...usual];
  }

  static rates(track: MediaStreamTrack | null): number[] {
    const most = track?.getCapabilities?.().frameRate?.max ?? 60;
    return RATES.filter((rate) => rate <= most + 0.5);
  }

  private static constraints(request: CameraRequest): MediaTrackConstraints {
    // Scaled pictures have another focal length than sensor.yaml says, and softer edges.
    const unscaled = { resizeMode: { ideal: 'none' } };
    return {
      ...(request.deviceId ? { deviceId: { exact: request.deviceId } } : { facingMode: { ideal: 'environment' } }),
      width: { ideal: request.width },
      height: { ideal: request.height },
      frameRate: { ideal: request.rate_hz },
      ...unscaled,
    };
  }

  private ended(turn: number, label: string): void {
    if (turn !== this.turn) return;
    this.become({ name: 'gone', label });
  }

  private async devicesChanged(): Promise<void> {
    const waiting = this.state.name === 'gone' || (this.state.name === 'failed' && this.state.waiting);
    if (!waiting || !this.request) return;
    const { request } = this;
    const there = await this.list();
    if (there.some((device) => !request.deviceId || device.deviceId === request.deviceId)) await this.open(request);
  }

  private become(state: CameraState): void {
    this.state = state;
    this.onState(state);
  }
}
