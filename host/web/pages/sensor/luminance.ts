// Luminance of the browser's pictures: the Y plane as the camera delivered it where the browser hands it over, else computed.
//
// Y is never stretched: the tracker needs one and the same grey for one and the same light, not a certain scale. Only by way of a
// canvas does the browser itself turn 16..235 into 0..255, and then cuts off what a camera of full range has beyond.
import type { LumaPath, LumaRange } from './messages';

export interface Luma {
  pixels: Uint8Array;
  width: number;
  height: number;
  stride: number;
  path: LumaPath;
  range: LumaRange;
}

const PLANAR = new Set(['I420', 'I420A', 'I422', 'I444', 'NV12']);
/** Rec. 601, 16 bits: what cameras make Y with. */
const [RED, GREEN, BLUE] = [19595, 38470, 7471];
const LARGEST_PX = 4096 * 2304;

export class LuminanceReader {
  private planes = new Uint8Array(0);
  private grey = new Uint8Array(0);
  private canvas: OffscreenCanvas | null = null;

  /** The pixels are valid until the next picture is read. Throws an Error with one line for people. */
  async read(frame: VideoFrame): Promise<Luma> {
    const rect = frame.visibleRect;
    const width = rect?.width ?? frame.codedWidth;
    const height = rect?.height ?? frame.codedHeight;
    LuminanceReader.check(width, height);
    if (!frame.format || !PLANAR.has(frame.format)) return this.draw(frame, width, height, 'from colours');
    const size = frame.allocationSize();
    if (this.planes.length < size) this.planes = new Uint8Array(size);
    const layout = (await frame.copyTo(this.planes))[0];
    if (!layout) throw new Error('the camera\'s pictures have no luminance: choose another mode or camera');
    const pixels = this.planes.subarray(layout.offset, layout.offset + layout.stride * height);
    const full = frame.colorSpace.fullRange;
    const range = full == null ? 'not told' : full ? 'full' : 'limited';
    return { pixels, width, height, stride: layout.stride, path: 'Y plane', range };
  }

  readBitmap(bitmap: ImageBitmap): Luma {
    LuminanceReader.check(bitmap.width, bitmap.height);
    return this.draw(bitmap, bitmap.width, bitmap.height, 'canvas');
  }

  private static check(width: number, height: number): void {
    if (width < 16 || height < 16 || width * height > LARGEST_PX) {
      throw new Error(`the camera's pictures are ${width}x${height}: choose a mode of up to 4096x2304`);
    }
  }

  private draw(picture: VideoFrame | ImageBitmap, width: number, height: number, path: LumaPath): Luma {
    if (this.canvas?.width !== width || this.canvas.height !== height) this.canvas = new OffscreenCanvas(width, height);
    const context = this.canvas.getContext('2d', { willReadFrequently: true });
    if (!context) throw new Error('this browser gives no canvas to read pictures with: update it');
    context.drawImage(picture, 0, 0, width, height);
    const rgba = context.getImageData(0, 0, width, height).data;
    if (this.grey.length !== width * height) this.grey = new Uint8Array(width * height);
    const grey = this.grey;
    for (let i = 0, j = 0; i < grey.length; i++, j += 4) {
      grey[i] = (RED * (rgba[j] ?? 0) + GREEN * (rgba[j + 1] ?? 0) + BLUE * (rgba[j + 2] ?? 0) + 32768) >> 16;
    }
    return { pixels: grey, width, height, stride: width, path, range: 'full' };
  }
}
