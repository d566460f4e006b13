// Finds tags in a whole picture: OpenCV.js, 11 MB, fetched when the target is not held for the first time. The
// same detector with the same parameters as the bridge's (host/tracker/tag_dictionary.cpp). It makes functions
// from text (embind), so a server that sends a content security policy with the worker's script must allow
// 'unsafe-eval' there, and there alone; a policy in the page itself does not reach a worker.
import library from '@techstark/opencv-js';
import type { FoundSquares, TagFinder } from './core_memory';
import { GRID_10X10 } from './grid_tags';

const UNSHARP_SIGMA_PX = 1.5;
const UNSHARP_AMOUNT = 2;

/** What is used of OpenCV.js. */
interface CvMat {
  rows: number;
  cols: number;
  data: Uint8Array;
  data32S: Int32Array;
  data32F: Float32Array;
  delete(): void;
}
interface CvMatVector {
  size(): number;
  get(index: number): CvMat;
  delete(): void;
}
interface CvDictionary {
  delete(): void;
}
interface CvParameters {
  cornerRefinementMethod: number;
  minMarkerDistanceRate: number;
}
interface CvDetector {
  detectMarkers(image: CvMat, corners: CvMatVector, ids: CvMat, rejected: CvMatVector): void;
  delete(): void;
}
interface OpenCv {
  Mat: new (rows?: number, columns?: number, type?: number) => CvMat;
  MatVector: new () => CvMatVector;
  Size: new (width: number, height: number) => object;
  aruco_DetectorParameters: new () => CvParameters;
  aruco_RefineParameters: new (distance: number, rate: number, all: boolean) => object;
  aruco_ArucoDetector: new (dictionary: CvDictionary, parameters: CvParameters, refine: object) => CvDetector;
  aruco_Dictionary: new (bytes: CvMat, size: number, correction: number) => CvDictionary;
  getPredefinedDictionary(which: number): CvDictionary;
  GaussianBlur(from: CvMat, to: CvMat, size: object, sigma: number): void;
  addWeighted(a: CvMat, alpha: number, b: CvMat, beta: number, gamma: number, to: CvMat): void;
  CV_8UC1: number;
  CORNER_REFINE_SUBPIX: number;
  onRuntimeInitialized?: () => void;
  [constant: `DICT_${string}`]: number;
}

/** "aruco_4x4_50" is DICT_4X4_50, "aruco_original" DICT_ARUCO_ORIGINAL, "apriltag_36h11" DICT_APRILTAG_36h11. */
function constantOf(family: string): `DICT_${string}` {
  if (family.startsWith('apriltag_')) return `DICT_APRILTAG_${family.slice('apriltag_'.length)}`;
  if (family === 'aruco_original') return 'DICT_ARUCO_ORIGINAL';
  return `DICT_${family.slice('aruco_'.length).toUpperCase()}`;
}

/** As OpenCV keeps a dictionary: a row of bytes for each tag, its cells as printed, then turned by each quarter. */
function gridDictionary(cv: OpenCv): CvDictionary {
  const { cells, ids, distance, white } = GRID_10X10;
  const last = cells - 1;
  const bytes = Math.ceil((cells * cells) / 8);
  const CV_8UC4 = 24;
  const list = new cv.Mat(ids, bytes, CV_8UC4);
  list.data.fill(0);
  for (let id = 0; id < ids; id++) {
    for (let i = 0; i < cells * cells; i++) {
      const row = Math.floor(i / cells);
      const column = i % cells;
      const turned: [number, number][] = [
        [row, column],
        [column, last - row],
        [last - row, last - column],
        [last - column, row],
      ];
      turned.forEach(([r, c], turns) => {
        const at = (id * 4 + turns) * bytes + (i >> 3);
        list.data[at] = ((list.data[at] ?? 0) << 1) | (white(id, r, c) ? 1 : 0);
      });
    }
  }
  return new cv.aruco_Dictionary(list, cells, Math.floor((distance - 1) / 2));
}

class OpenCvFinder implements TagFinder {
  private readonly detectors = new Map<string, CvDetector>();

  constructor(private readonly cv: OpenCv) {}

  find(luma: Uint8Array, width: number, height: number, family: string, sharpen: boolean): FoundSquares {
    const { cv } = this;
    const image = new cv.Mat(height, width, cv.CV_8UC1);
    const corners = new cv.MatVector();
    const rejected = new cv.MatVector();
    const ids = new cv.Mat();
    try {
      image.data.set(luma);
      if (sharpen) this.sharpen(image);
      this.detector(family).detectMarkers(image, corners, ids, rejected);
      return { ids: ids.data32S.slice(), tags: OpenCvFinder.squares(corners), others: OpenCvFinder.squares(rejected) };
    } finally {
      for (const object of [image, corners, rejected, ids]) object.delete();
    }
  }

  /** An unsharp mask. */
  private sharpen(image: CvMat): void {
    const blurred = new this.cv.Mat();
    this.cv.GaussianBlur(image, blurred, new this.cv.Size(0, 0), UNSHARP_SIGMA_PX);
    this.cv.addWeighted(image, 1 + UNSHARP_AMOUNT, blurred, -UNSHARP_AMOUNT, 0, image);
    blurred.delete();
  }

  private detector(family: string): CvDetector {
    const { cv } = this;
    const known = this.detectors.get(family);
    if (known) return known;
    const parameters = new cv.aruco_DetectorParameters();
    parameters.cornerRefinementMethod = cv.CORNER_REFINE_SUBPIX;
    // The paper's outline lies close around the black square; the default would keep the outline, not the square.
    parameters.minMarkerDistanceRate = 0.008;
    const dictionary =
      family === 'grid_10x10' ? gridDictionary(cv) : cv.getPredefinedDictionary(cv[constantOf(family)] ?? -1);
    const detector = new cv.aruco_ArucoDetector(dictionary, parameters, new cv.aruco_RefineParameters(10, 3, true));
    this.detectors.set(family, detector);
    return detector;
  }

  private static squares(list: CvMatVector): Float32Array {
    const out = new Float32Array(8 * list.size());
    for (let i = 0; i < list.size(); i++) {
      const square = list.get(i);
      out.set(square.data32F.subarray(0, 8), 8 * i);
      square.delete();
    }
    return out;
  }
}

/** Resolves when OpenCV.js is ready. The module itself looks like a promise that never ends, so it is not awaited. */
export async function loadFinder(): Promise<TagFinder> {
  const cv = library as unknown as OpenCv;
  await new Promise<void>((resolve) => {
    if ((cv as Partial<OpenCv>).Mat) resolve();
    else cv.onRuntimeInitialized = () => resolve();
  });
  return new OpenCvFinder(cv);
}
