// The core's memory as TypeScript sees it: what it exports (host/web/wasm/browser_core.cpp), and where the
// numbers of a sample lie in it (struct PageSample in host/web/wasm/browser_core.cpp).

export interface FoundSquares {
  /** Of the family; one for each eight numbers of `tags`. */
  ids: Int32Array;
  /** x, y of four corners each, clockwise, top left first as printed; px. */
  tags: Float32Array;
  /** Four corners, but no tag of the family. */
  others: Float32Array;
}

/** Finds tags in a whole picture (finder.ts); `luma` has no padding and is borrowed. */
export interface TagFinder {
  find(luma: Uint8Array, width: number, height: number, family: string, sharpen: boolean): FoundSquares;
}

/** What the core asks of the page. */
export interface CorePage {
  sha256(bytes: Uint8Array): Uint8Array;
  decodePng(bytes: Uint8Array, width: number, height: number): Uint16Array | null;
  finder: TagFinder | null;
}

export interface CoreModuleOptions {
  page: CorePage;
  locateFile?: (name: string) => string;
  wasmBinary?: BufferSource;
  /** Lines of the runtime; the core has none to say. */
  printErr?: (line: string) => void;
}

export interface CoreModule {
  HEAPU8: Uint8Array;
  HEAPF64: Float64Array;
  UTF8ToString(at: number): string;
  stringToUTF8(text: string, at: number, most: number): void;
  lengthBytesUTF8(text: string): number;
  _malloc(bytes: number): number;
  _free(at: number): void;
  _tagwrench_create(): number;
  _tagwrench_measured(core: number, name: number, at: number, bytes: number): void;
  _tagwrench_open(
    core: number,
    yaml: number,
    name: number,
    calibration: number,
    appearance: number,
    bytes: number,
  ): number;
  _tagwrench_text(core: number): number;
  _tagwrench_frame(core: number, height: number, stride: number): number;
  _tagwrench_track(
    core: number,
    width: number,
    height: number,
    stride: number,
    t_ns: bigint,
    sequence: number,
  ): number;
  _tagwrench_zero(core: number): void;
  _tagwrench_diagnostic(core: number): number;
  _tagwrench_learned(core: number, date: number): number;
}

/** Places in a sample, counted in numbers. */
export const AT = {
  status: 0,
  displacement: 1,
  displacementSigma: 7,
  wrench: 13,
  wrenchSigma: 19,
  zero: 25,
  zeroState: 31,
  tagsHeld: 32,
  residualPx: 33,
  residualPart: 34,
  blurPx2: 35,
  wanted: 36,
  needsWholeFrame: 40,
  news: 41,
  tags: 42,
  tag: 43,
} as const;

/** Numbers of one tag: its id, then x and y of its corners. */
export const TAG_NUMBERS = 9;
