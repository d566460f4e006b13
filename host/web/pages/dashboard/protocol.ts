// What the bridge and this page say to each other. What comes in is checked here, once; unknown keys and
// types are ignored.

export const PROTOCOL = 1;

export interface Hello {
  protocol: number;
  version: string;
  name: string;
  source: string;
  sensor: string;
  camera: { width: number; height: number; mirrored: boolean };
  range_n: readonly number[];
  range_nm: readonly number[];
  calibrated: string | null;
  axes_from_springs: readonly string[];
  folder: string;
  /** Rows: the device's X, Y and Z as camera axes. */
  hid_R_camera: readonly number[];
  can: {
    camera_settings: boolean;
    led: boolean;
    cells: readonly number[];
    profiles: boolean;
    record: boolean;
    jobs: readonly string[];
  };
}

export interface CameraControl {
  id: number;
  name: string;
  value: number;
  minimum: number;
  maximum: number;
  step: number;
  writable: boolean;
}

export interface ProfileState {
  name: string;
  names: readonly string[];
  text: string;
  trial: boolean;
}

export interface RecordingState {
  file: string;
  seconds: number;
  bytes: number;
  frames: number;
  dropped: number;
  disk_left_s: number;
}

export interface Coverage {
  axes?: readonly number[];
  regions?: readonly number[];
  views?: number;
  wanted?: number;
  missing?: readonly string[];
  range?: readonly number[];
  keyframes?: number;
}

export type JobState = 'running' | 'done' | 'failed' | 'stopped';

export interface Job {
  verb: string;
  state: JobState;
  lines: readonly { kind: string; text: string }[];
  live: string;
  coverage: Coverage | null;
  progress: number | null;
  keys: readonly string[];
  result: Record<string, unknown> | null;
}

export interface BridgeState {
  rate_hz: number;
  latency_us: { median: number; p99: number };
  jitter_us: number;
  dropped: number;
  skipped: number;
  frames: number;
  status: string;
  words: string;
  /** False: the sensor could not be started, or its camera is lent to a job. */
  running: boolean;
  /** It does not run yet, and nothing went wrong. */
  settingUp: boolean;
  image: {
    white: number;
    black: number;
    clipped_part: number;
    edges_px: readonly { id: number; px: number }[];
    residual_part: number;
  } | null;
  profile: ProfileState | null;
  zero_state: string;
  clients: readonly { name: string; by: string }[];
  recording: RecordingState | null;
  board: {
    led: number;
    exposure_us: number;
    cells: readonly { channel: number; n: number; sigma_n: number }[];
  } | null;
  camera_controls: readonly CameraControl[];
  job: Job | null;
}

export interface Answer {
  id: number;
  ok: boolean;
  text: string;
  data: unknown;
}

export interface PictureHeader {
  seq: number;
  width: number;
  height: number;
  tags: readonly { id: number; px: readonly number[] }[];
  status: string;
}

export interface Picture {
  header: PictureHeader;
  jpeg: Blob;
}

type Said = Record<string, unknown>;

export function said(value: unknown): Said {
  return typeof value === 'object' && value !== null && !Array.isArray(value) ? (value as Said) : {};
}

export function numberIn(value: unknown, otherwise = 0): number {
  return typeof value === 'number' && Number.isFinite(value) ? value : otherwise;
}

export function textIn(value: unknown, otherwise = ''): string {
  return typeof value === 'string' ? value : otherwise;
}

export function listIn<T>(value: unknown, item: (value: unknown) => T): T[] {
  return Array.isArray(value) ? value.map(item) : [];
}

function numbersIn(value: unknown): number[] {
  return listIn(value, (v) => numberIn(v));
}

function textsIn(value: unknown): string[] {
  return listIn(value, (v) => textIn(v)).filter((text) => text !== '');
}

/**
 * The camera looks up from below, its x to the user's right: as a sensor is mounted unless its description
 * says otherwise.
 */
const USUAL_MOUNTING = [1, 0, 0, 0, -1, 0, 0, 0, -1];

function rotationFrom(value: unknown): readonly number[] {
  const rows = numbersIn(value);
  return rows.length === 9 ? rows : USUAL_MOUNTING;
}

export function helloFrom(message: Said): Hello {
  const camera = said(message.camera);
  const can = said(message.can);
  return {
    protocol: numberIn(message.protocol),
    version: textIn(message.version, '?'),
    name: textIn(message.name, 'sensor'),
    source: textIn(message.source),
    sensor: textIn(message.sensor),
    camera: {
      width: numberIn(camera.width, 640),
      height: numberIn(camera.height, 480),
      mirrored: camera.mirrored === true,
    },
    range_n: numbersIn(message.range_n),
    range_nm: numbersIn(message.range_nm),
    calibrated: typeof message.calibrated === 'string' ? message.calibrated : null,
    axes_from_springs: textsIn(message.axes_from_springs),
    folder: textIn(message.folder),
    hid_R_camera: rotationFrom(message.hid_R_camera),
    can: {
      camera_settings: can.camera_settings === true,
      led: can.led === true,
      cells: numbersIn(can.cells),
      profiles: can.profiles === true,
      record: can.record !== false,
      jobs: textsIn(can.jobs),
    },
  };
}

function profileFrom(value: unknown): ProfileState | null {
  if (value == null) return null;
  const { name, names, text, trial } = said(value);
  return { name: textIn(name), names: textsIn(names), text: textIn(text), trial: trial === true };
}

function recordingFrom(value: unknown): RecordingState | null {
  if (value == null) return null;
  const r = said(value);
  return {
    file: textIn(r.file),
    seconds: numberIn(r.seconds),
    bytes: numberIn(r.bytes),
    frames: numberIn(r.frames),
    dropped: numberIn(r.dropped),
    disk_left_s: numberIn(r.disk_left_s, Number.NaN),
  };
}

function coverageFrom(value: unknown): Coverage | null {
  if (value == null) return null;
  const c = said(value);
  const coverage: Coverage = {};
  for (const key of ['axes', 'regions', 'range'] as const)
    if (Array.isArray(c[key])) coverage[key] = numbersIn(c[key]);
  for (const key of ['views', 'wanted', 'keyframes'] as const)
    if (typeof c[key] === 'number') coverage[key] = numberIn(c[key]);
  if (Array.isArray(c.missing)) coverage.missing = textsIn(c.missing);
  return coverage;
}

const JOB_STATES: readonly JobState[] = ['running', 'done', 'failed', 'stopped'];

export function jobFrom(value: unknown): Job | null {
  if (value == null) return null;
  const job = said(value);
  return {
    verb: textIn(job.verb),
    state: JOB_STATES.find((state) => state === job.state) ?? 'running',
    lines: listIn(job.lines, (line) => ({
      kind: textIn(said(line).kind, 'note'),
      text: textIn(said(line).text),
    })),
    live: textIn(job.live),
    coverage: coverageFrom(job.coverage),
    progress: typeof job.progress === 'number' ? job.progress : null,
    keys: textsIn(job.keys),
    result: job.result == null ? null : said(job.result),
  };
}

function imageFrom(value: unknown): BridgeState['image'] {
  if (value == null) return null;
  const image = said(value);
  return {
    white: numberIn(image.white),
    black: numberIn(image.black),
    clipped_part: numberIn(image.clipped_part),
    edges_px: listIn(image.edges_px, (edge) => ({
      id: numberIn(said(edge).id),
      px: numberIn(said(edge).px),
    })),
    residual_part: numberIn(image.residual_part),
  };
}

function boardFrom(value: unknown): BridgeState['board'] {
  if (value == null) return null;
  const board = said(value);
  const cells = listIn(board.cells, (cell) => {
    const { channel, n, sigma_n } = said(cell);
    return { channel: numberIn(channel), n: numberIn(n, Number.NaN), sigma_n: numberIn(sigma_n, Number.NaN) };
  });
  return { led: numberIn(board.led, Number.NaN), exposure_us: numberIn(board.exposure_us), cells };
}

function controlFrom(value: unknown): CameraControl {
  const control = said(value);
  return {
    id: numberIn(control.id),
    name: textIn(control.name, '?'),
    value: numberIn(control.value),
    minimum: numberIn(control.minimum),
    maximum: numberIn(control.maximum),
    step: numberIn(control.step, 1) || 1,
    writable: control.writable === true,
  };
}

export function stateFrom(message: Said): BridgeState {
  const latency = said(message.latency_us);
  return {
    rate_hz: numberIn(message.rate_hz, Number.NaN),
    latency_us: { median: numberIn(latency.median, Number.NaN), p99: numberIn(latency.p99, Number.NaN) },
    jitter_us: numberIn(message.jitter_us, Number.NaN),
    dropped: numberIn(message.dropped),
    skipped: numberIn(message.skipped),
    frames: numberIn(message.frames),
    status: textIn(message.status),
    words: textIn(message.words),
    running: message.running !== false,
    settingUp: message.setting_up === true,
    image: imageFrom(message.image),
    profile: profileFrom(message.profile),
    zero_state: textIn(message.zero_state),
    clients: listIn(message.clients, (client) => ({
      name: textIn(said(client).name, '?'),
      by: textIn(said(client).by),
    })),
    recording: recordingFrom(message.recording),
    board: boardFrom(message.board),
    camera_controls: listIn(message.camera_controls, controlFrom),
    job: jobFrom(message.job),
  };
}

export function answerFrom(message: Said): Answer {
  return {
    id: numberIn(message.id, -1),
    ok: message.ok === true,
    text: textIn(message.text),
    data: message.data,
  };
}

const LONGEST_HEADER = 65536;

/** A binary message: the length of a JSON header, the header, a JPEG. Null if it is anything else. */
export function pictureFrom(message: ArrayBuffer): Picture | null {
  if (message.byteLength < 4) return null;
  const length = new DataView(message).getUint32(0, true);
  if (length > LONGEST_HEADER || 4 + length >= message.byteLength) return null;
  try {
    const header = said(JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length))));
    const tags = listIn(header.tags, (tag) => ({ id: numberIn(said(tag).id), px: numbersIn(said(tag).px) }));
    return {
      header: {
        seq: numberIn(header.seq),
        width: numberIn(header.width),
        height: numberIn(header.height),
        tags,
        status: textIn(header.status),
      },
      jpeg: new Blob([new Uint8Array(message, 4 + length)], { type: 'image/jpeg' }),
    };
  } catch {
    return null;
  }
}
