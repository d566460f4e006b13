// What page and worker say to each other. The worker has the camera's pictures and the tracker; the page shows.
import type { Sample } from '../common/sample';
import type { CoreSample, SensorInfo } from './core';

/** The files of the folder measured/ that the core reads, by name. */
export type MeasuredFiles = Partial<Record<MeasuredName, Uint8Array>>;
export const MEASURED_NAMES = ['camera.yaml', 'target.yaml', 'rest.png', 'wrench.json', 'zero.yaml'] as const;
export type MeasuredName = (typeof MEASURED_NAMES)[number];

/** What describes a sensor; `name` is what people call it, mostly a file's name. */
export interface SensorFiles {
  name: string;
  yaml: string;
  calibration?: string;
  appearance?: Uint8Array;
  measured?: MeasuredFiles;
}

/** How pictures come: their luminance untouched, computed from colours, or by way of a canvas. */
export type LumaPath = 'Y plane' | 'from colours' | 'canvas';
export type LumaRange = 'full' | 'limited' | 'not told';

export interface Feed {
  path: LumaPath;
  range: LumaRange;
  width: number;
  height: number;
  rate_hz: number;
  /** Medians of the last second, ms: of the tracker alone, and from the picture's hand-over to its result. */
  track_ms: number;
  latency_ms: number;
  /** Pictures that were never looked at, since the camera was opened. */
  dropped: number;
  /** Of the tags in view while the rest pose is learned: pictures so far, pictures wanted; null: not learning. */
  learning: { done: number; wanted: number } | null;
}

export type ToWorker =
  | { kind: 'open'; id: number; files: SensorFiles }
  | { kind: 'stream'; readable: ReadableStream<VideoFrame> }
  | { kind: 'bitmap'; bitmap: ImageBitmap; time_us: number }
  | { kind: 'stop' }
  | { kind: 'zero' }
  | { kind: 'learned'; id: number; date: string }
  | { kind: 'pictures'; on: boolean };

export type FromWorker =
  | { kind: 'ready' }
  | { kind: 'broken'; text: string }
  | { kind: 'opened'; id: number; info: SensorInfo }
  | { kind: 'refused'; id: number; text: string }
  | { kind: 'sample'; sample: Sample; feed: Feed }
  | { kind: 'hint'; text: string }
  | { kind: 'finder'; state: 'loading' | 'ready' | 'failed'; text: string }
  | { kind: 'picture'; bitmap: ImageBitmap; scale: number; corners: CoreSample['corners']; status: Sample['status'] }
  | { kind: 'learned'; id: number; files: Record<string, string> }
  | { kind: 'took' }
  | { kind: 'unreadable'; text: string }
  | { kind: 'ended' };
