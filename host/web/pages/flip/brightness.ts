// Mean brightness of a camera's pictures, each with the time at which the browser handed it over.
import { make } from '../common/elements';

export interface Brightness {
  /** 0..255 */
  level: number;
  /** The page's clock. */
  arrived_ms: number;
  /** The picture's own stamp; its zero is anywhere. */
  stamp_us: number;
}

const WIDTH = 32;
const HEIGHT = 24;

export class BrightnessReader {
  private readonly context = make('canvas', { width: WIDTH, height: HEIGHT }).getContext('2d', { willReadFrequently: true });
  private stopped = false;

  constructor(private readonly onPicture: (brightness: Brightness) => void) {}

  start(track: MediaStreamTrack): void {
    if ('MediaStreamTrackProcessor' in window) void this.read(new MediaStreamTrackProcessor({ track }).readable.getReader());
    else this.watch(track);
  }

  stop(): void {
    this.stopped = true;
  }

  private async read(reader: ReadableStreamDefaultReader<VideoFrame>): Promise<void> {
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return;
      const arrived_ms = performance.now();
      const stamp_us = value.timestamp;
      const level = this.level(value);
      value.close();
      if (this.stopped) return void reader.cancel();
      this.onPicture({ level, arrived_ms, stamp_us });
    }
  }

  private watch(track: MediaStreamTrack): void {
    const video = make('video', { muted: true, playsinline: true });
    video.srcObject = new MediaStream([track]);
    void video.play().catch(() => undefined); // refused only when stopped meanwhile
    const next = (): void => {
      video.requestVideoFrameCallback((now_ms, { captureTime, mediaTime }) => {
        if (this.stopped) return;
        this.onPicture({ level: this.level(video), arrived_ms: now_ms, stamp_us: 1e3 * (captureTime ?? 1e3 * mediaTime) });
        next();
      });
    };
    next();
  }

  private level(picture: VideoFrame | HTMLVideoElement): number {
    if (!this.context) return 0;
    this.context.drawImage(picture, 0, 0, WIDTH, HEIGHT);
    const { data } = this.context.getImageData(0, 0, WIDTH, HEIGHT);
    let sum = 0;
    for (let i = 0; i < data.length; i += 4) sum += (data[i] ?? 0) + (data[i + 1] ?? 0) + (data[i + 2] ?? 0);
    return sum / (3 * WIDTH * HEIGHT);
  }
}
