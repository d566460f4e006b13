// The tracker and the wrench estimate, compiled to WebAssembly from the bridge's own sources.
import { sha256 } from '@noble/hashes/sha2';
import { decode } from 'fast-png';
import createModule from '@core/core.mjs';
import wasmUrl from '@core/core.wasm?url';
import type { Status, ZeroState } from '../common/sample';
import { AT, TAG_NUMBERS, type CoreModule, type CorePage, type TagFinder } from './core_memory';
import type { MeasuredFiles } from './messages';
import { checkWebAssembly } from './wasm_support';

export type { TagFinder } from './core_memory';

/** Units are SI; six-vectors are translation before rotation, force before torque. */
export interface CoreSample {
  seq: number;
  t_ns: bigint;
  status: Status;
  d_m: number[];
  d_rad: number[];
  d_sigma: number[];
  f_n: number[];
  m_nm: number[];
  w_sigma: number[];
  /** What has been taken off the wrench. */
  zero: number[];
  zero_state: ZeroState;
  /** While the rest pose is learned: tags in view. */
  tags_held: number;
  residual_px: number;
  /** What the fit to the picture at rest leaves, over the contrast between black and white; 0: no such picture. */
  residual_part: number;
  /** How much wider the image of an edge is than at rest, as growth of its variance. */
  blur_px2: number;
  /** x, y of each tag's corners as printed, top left first, in the camera's picture; px. */
  corners: { id: number; px: number[] }[];
  /** What the next picture must show to be tracked; zeros: all of it. */
  wanted: { x: number; y: number; width: number; height: number };
  needs_whole_frame: boolean;
}

export interface SensorInfo {
  name: string;
  width: number;
  height: number;
  mirrored: boolean;
  family: string;
  tag_ids: number[];
  tag_size_mm: number;
  /** Pictures that the rest pose is learned from. */
  rest_frames: number;
  /** By sensor.yaml, together with the tags' places: nothing is learned. */
  rest_given: boolean;
  /** A picture of the sensor at rest is in force. */
  appearance: boolean;
  /** The calibration's file; empty: newtons come from the springs' stiffness. */
  calibration: string;
  /** +- N and N m; 0: not known. */
  range_n: number[];
  range_nm: number[];
  /** Which file tells camera, target, wrench and zero, and of when. */
  in_force: string[];
  /** All of it, in a few words. */
  words: string;
}

interface Description extends Omit<SensorInfo, 'name' | 'words' | 'width' | 'height' | 'mirrored'> {
  camera: { width: number; height: number; mirrored: boolean };
}

const STATUS: readonly Status[] = ['ok', 'acquiring', 'lost', 'doubtful', 'saturated'];
const ZERO: readonly ZeroState[] = ['off', 'touched', 'far', 'following'];

function page(): CorePage {
  return {
    sha256: (bytes) => sha256(bytes.slice()),
    decodePng: (bytes, width, height) => {
      try {
        const picture = decode(bytes.slice(), { checkCrc: true });
        if (picture.depth !== 16 || picture.channels !== 1) return null;
        if (picture.width !== width || picture.height !== height) return null;
        return picture.data instanceof Uint16Array ? picture.data : null;
      } catch {
        return null; // damaged: the core says so, and what to do
      }
    },
    finder: null,
  };
}

function words(d: Description): string {
  const ids = `${d.tag_ids.length === 1 ? 'tag' : 'tags'} ${d.tag_ids.join(', ')}`;
  const tags = `${ids} of ${d.family}, ${d.tag_size_mm.toPrecision(3)} mm`;
  const newtons = d.calibration === '' ? "newtons from the springs' stiffness" : `newtons from ${d.calibration}`;
  const rest = d.rest_given ? 'rest as calibrated' : `rest learned from the first ${d.rest_frames} pictures`;
  return `${tags}; ${newtons}; ${rest}`;
}

export class Core {
  private readonly core: number;
  private finderMissed = false;

  private constructor(
    private readonly module: CoreModule,
    private readonly page: CorePage,
  ) {
    this.core = module._tagwrench_create();
  }

  /** Throws an Error that says what the browser lacks. `wasm`: its bytes, where they cannot be fetched. */
  static async load(wasm?: BufferSource): Promise<Core> {
    checkWebAssembly();
    const answers = page();
    const from = wasm ? { wasmBinary: wasm } : { locateFile: () => wasmUrl };
    return new Core(await createModule({ page: answers, ...from }), answers);
  }

  /**
   * Throws an Error with one line that says what is wrong, where, and what to do; what was open stays open then.
   * The other files are those that the text names as wrench.calibration and rest.appearance, and those of measured/ beside it.
   */
  open(sensorYaml: string, name: string, calibrationJson?: string, appearance?: Uint8Array, measured: MeasuredFiles = {}): SensorInfo {
    const m = this.module;
    for (const [file, bytes] of Object.entries(measured)) this.putMeasured(file, bytes);
    const places = [sensorYaml, name, calibrationJson].map((text) => (text === undefined ? 0 : this.put(text)));
    const picture = appearance && appearance.length > 0 ? m._malloc(appearance.length) : 0;
    if (appearance && picture !== 0) m.HEAPU8.set(appearance, picture);
    const [yaml = 0, file = 0, calibration = 0] = places;
    const opened = m._tagwrench_open(this.core, yaml, file, calibration, picture, appearance?.length ?? 0);
    for (const place of [...places, picture]) m._free(place);
    const text = m.UTF8ToString(m._tagwrench_text(this.core));
    if (opened === 0) throw new Error(text);
    const { camera, ...rest } = JSON.parse(text) as Description;
    const { width, height, mirrored } = camera;
    return { ...rest, width, height, mirrored, name, words: words({ camera, ...rest }) };
  }

  /** The target is not held, and there is nobody yet to find it: hand one in (finder.ts). */
  get needsFinder(): boolean {
    return this.page.finder === null && this.finderMissed;
  }

  setFinder(finder: TagFinder): void {
    this.page.finder = finder;
  }

  /** `luma`: height rows of `stride` bytes, the last of which may be shorter; copied once. Times grow. */
  track(luma: Uint8Array, width: number, height: number, stride: number, t_ns: bigint, sequence: number): CoreSample {
    const m = this.module;
    const at = m._tagwrench_frame(this.core, height, stride);
    const bytes = stride * height;
    if (at === 0) throw new Error('no memory for a picture of this size; reload the page, or choose a smaller picture');
    m.HEAPU8.set(luma.length > bytes ? luma.subarray(0, bytes) : luma, at);
    const result = m._tagwrench_track(this.core, width, height, stride, t_ns, sequence);
    if (result === 0) throw new Error('no sensor is open; choose a sensor.yaml first');
    const sample = this.sample(result / 8, t_ns, sequence);
    this.finderMissed = sample.status === 'acquiring' || sample.status === 'lost';
    return sample;
  }

  /** With the next sample at rest, what reads is nothing. */
  zero(): void {
    this.module._tagwrench_zero(this.core);
  }

  /** What the tracker noticed last, in words; empty when all is well. */
  hint(): string {
    return this.module.UTF8ToString(this.module._tagwrench_diagnostic(this.core));
  }

  /**
   * What was learned at rest, as files of measured/: none where rest and places were given. Throws an Error while nothing is known.
   * `date`: YYYY-MM-DD.
   */
  learned(date: string): Record<string, string> {
    const at = this.put(date);
    const text = this.module.UTF8ToString(this.module._tagwrench_learned(this.core, at));
    this.module._free(at);
    const files = JSON.parse(text) as Record<string, string> | null;
    if (!files) throw new Error('the rest pose is not known yet; let the platform stand still before the camera');
    return files;
  }

  /** Of the tracker, picture included. */
  get memoryBytes(): number {
    return this.module.HEAPU8.byteLength;
  }

  private putMeasured(file: string, bytes: Uint8Array): void {
    const name = this.put(file);
    const at = this.module._malloc(Math.max(1, bytes.length));
    this.module.HEAPU8.set(bytes, at);
    this.module._tagwrench_measured(this.core, name, at, bytes.length);
    this.module._free(at);
    this.module._free(name);
  }

  private put(text: string): number {
    const bytes = this.module.lengthBytesUTF8(text) + 1;
    const at = this.module._malloc(bytes);
    this.module.stringToUTF8(text, at, bytes);
    return at;
  }

  private sample(first: number, t_ns: bigint, seq: number): CoreSample {
    const numbers = this.module.HEAPF64;
    const one = (at: number): number => numbers[first + at] ?? 0;
    const some = (at: number, count: number): number[] => Array.from(numbers.subarray(first + at, first + at + count));
    const corners = Array.from({ length: one(AT.tags) }, (_, t) => {
      const at = AT.tag + t * TAG_NUMBERS;
      return { id: one(at), px: some(at + 1, 8) };
    });
    return {
      seq,
      t_ns,
      status: STATUS[one(AT.status)] ?? 'lost',
      d_m: some(AT.displacement, 3),
      d_rad: some(AT.displacement + 3, 3),
      d_sigma: some(AT.displacementSigma, 6),
      f_n: some(AT.wrench, 3),
      m_nm: some(AT.wrench + 3, 3),
      w_sigma: some(AT.wrenchSigma, 6),
      zero: some(AT.zero, 6),
      zero_state: ZERO[one(AT.zeroState)] ?? 'off',
      tags_held: one(AT.tagsHeld),
      residual_px: one(AT.residualPx),
      residual_part: one(AT.residualPart),
      blur_px2: one(AT.blurPx2),
      corners,
      wanted: {
        x: one(AT.wanted),
        y: one(AT.wanted + 1),
        width: one(AT.wanted + 2),
        height: one(AT.wanted + 3),
      },
      needs_whole_frame: one(AT.needsWholeFrame) === 1,
    };
  }
}
