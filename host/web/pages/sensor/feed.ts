// A camera's pictures on their way to the worker: as a stream of video frames where the browser has that, else drawn by the page.
import type { TrackerClient } from './tracker_client';

/** Draws every picture that the browser shows, one at a time: while the worker has one, newer ones are left out. */
class DrawnFeed {
  private readonly video = document.createElement('video');
  private free = true;
  private stopped = false;

  constructor(track: MediaStreamTrack, private readonly client: TrackerClient) {
    this.video.muted = true;
    this.video.playsInline = true;
    this.video.srcObject = new MediaStream([track]);
    client.onTook = () => {
      this.free = true;
    };
    void this.video.play().catch(() => undefined); // refused only when stopped meanwhile
    this.next();
  }

  stop(): void {
    this.stopped = true;
    this.video.srcObject = null;
  }

  private next(): void {
    if (this.stopped) return;
    this.video.requestVideoFrameCallback((now_ms, { captureTime }) => {
      if (this.free) void this.hand(1e3 * (captureTime ?? now_ms));
      this.next();
    });
  }

  private async hand(time_us: number): Promise<void> {
    this.free = false;
    try {
      const bitmap = await createImageBitmap(this.video);
      this.client.send({ kind: 'bitmap', bitmap, time_us }, [bitmap]);
    } catch {
      this.free = true; // no picture there yet
    }
  }
}

export const hasVideoFrames = (): boolean => 'MediaStreamTrackProcessor' in window;

export class CameraFeed {
  private drawn: DrawnFeed | null = null;

  constructor(private readonly client: TrackerClient) {}

  start(track: MediaStreamTrack): void {
    this.stop();
    if (hasVideoFrames()) {
      const { readable } = new MediaStreamTrackProcessor({ track });
      this.client.send({ kind: 'stream', readable }, [readable]);
    } else {
      this.drawn = new DrawnFeed(track, this.client);
    }
  }

  stop(): void {
    this.drawn?.stop();
    this.drawn = null;
    this.client.send({ kind: 'stop' });
  }
}
