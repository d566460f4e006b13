// One picture in, one sample out: luminance, tracker, figures, and what the page is told of it.
import type { Sample } from '../common/sample';
import type { Core, CoreSample, SensorInfo } from './core';
import { FeedFigures } from './feed_figures';
import { LuminanceReader, type Luma } from './luminance';
import type { Feed, FromWorker } from './messages';
import type { Closable } from './newest';

const PICTURES_EVERY_MS = 100;
const WIDEST_PICTURE_PX = 640;
const SAME_TROUBLE_MS = 2000;

/** A picture as the browser gave it, and when it did. */
export class Arrival implements Closable {
  readonly arrived_ms = performance.now();
  constructor(
    readonly picture: VideoFrame | ImageBitmap,
    readonly time_us: number,
  ) {}
  close(): void {
    this.picture.close();
  }
}

export class Tracking {
  picturesWanted = false;
  private readonly luminance = new LuminanceReader();
  private figures = new FeedFigures();
  private sequence = 0;
  private hint = '';
  private learned = 0;
  private picture_ms = Number.NEGATIVE_INFINITY;
  private trouble_ms = Number.NEGATIVE_INFINITY;

  constructor(
    private readonly core: Core,
    private readonly info: SensorInfo,
    private readonly tell: (message: FromWorker, transfer?: Transferable[]) => void,
  ) {}

  /** A camera was opened: its clock is another one. */
  newFeed(): void {
    this.figures = new FeedFigures();
  }

  async take(arrival: Arrival): Promise<void> {
    try {
      const { picture } = arrival;
      const luma = picture instanceof ImageBitmap ? this.luminance.readBitmap(picture) : await this.luminance.read(picture);
      this.track(arrival, luma);
    } catch (error) {
      this.say(error instanceof Error ? error.message : String(error));
    } finally {
      arrival.close();
    }
  }

  private track(arrival: Arrival, luma: Luma): void {
    const { figures, core } = this;
    const dropped = figures.arrived(arrival.time_us, arrival.arrived_ms);
    this.sequence += 1 + dropped;
    const begun_ms = performance.now();
    const time_ns = BigInt(Math.round(arrival.time_us)) * 1000n;
    const result = core.track(luma.pixels, luma.width, luma.height, luma.stride, time_ns, this.sequence);
    const latency_us = figures.tracked(arrival.time_us, begun_ms, performance.now());
    const sample: Sample = { ...Tracking.plain(result), dropped, latency_us };
    this.tell({ kind: 'sample', sample, feed: this.feed(luma, result) });
    const hint = core.hint();
    if (hint !== this.hint) this.tell({ kind: 'hint', text: (this.hint = hint) });
    if (this.picturesWanted && performance.now() - this.picture_ms >= PICTURES_EVERY_MS) this.show(luma, result);
  }

  private static plain(r: CoreSample): Omit<Sample, 'dropped' | 'latency_us'> {
    const { seq, status, d_m, d_rad, d_sigma, f_n, m_nm, w_sigma, tags_held, residual_px, zero_state } = r;
    return { seq, t_ns: Number(r.t_ns), status, d_m, d_rad, d_sigma, f_n, m_nm, w_sigma, tags_held, residual_px, zero_state };
  }

  private feed(luma: Luma, result: CoreSample): Feed {
    const { figures, info } = this;
    const learns = !info.rest_given && result.status === 'acquiring' && result.tags_held === info.tag_ids.length;
    this.learned = learns ? this.learned + 1 : 0;
    const wanted = info.rest_frames;
    const learning = this.learned > 0 && wanted > 0 ? { done: Math.min(this.learned, wanted), wanted } : null;
    return {
      path: luma.path, range: luma.range, width: luma.width, height: luma.height,
      rate_hz: figures.rate_hz, track_ms: figures.track_ms, latency_ms: figures.latency_ms, dropped: figures.dropped, learning,
    };
  }

  /** What the tracker saw, grey, with the outlines that belong to it. */
  private show(luma: Luma, result: CoreSample): void {
    this.picture_ms = performance.now();
    const step = Math.ceil(luma.width / WIDEST_PICTURE_PX);
    const width = Math.floor(luma.width / step);
    const height = Math.floor(luma.height / step);
    const rgba = new Uint32Array(width * height);
    for (let y = 0, i = 0; y < height; y++) {
      for (let x = 0, from = y * step * luma.stride; x < width; x++, from += step) {
        rgba[i++] = 0xff000000 | ((luma.pixels[from] ?? 0) * 0x010101);
      }
    }
    const image = new ImageData(new Uint8ClampedArray(rgba.buffer), width, height);
    void createImageBitmap(image).then((bitmap) => {
      this.tell({ kind: 'picture', bitmap, scale: 1 / step, corners: result.corners, status: result.status }, [bitmap]);
    });
  }

  private say(text: string): void {
    const now = performance.now();
    if (now - this.trouble_ms < SAME_TROUBLE_MS) return;
    this.trouble_ms = now;
    this.tell({ kind: 'unreadable', text });
  }
}
