// What the tracker sees: its grey picture, with outlines of the tags that belong to this very picture.
import { make } from '../common/elements';
import { carriesNumbers } from '../common/sample';
import type { FromWorker } from './messages';

type Picture = Extract<FromWorker, { kind: 'picture' }>;

/** Over a grey picture in any theme: bright, with a dark edge. */
const HELD = '#3fe08f';
const NOT_TRUSTED = '#ffb84d';
const EDGE = 'rgba(0, 0, 0, 0.65)';
const OUTLINE_PX = 2.5;

export class PictureView {
  readonly canvas = make('canvas', { class: 'picture', width: 640, height: 480, role: 'img' });

  constructor(parent: HTMLElement) {
    parent.append(this.canvas);
    this.clear();
  }

  clear(): void {
    this.canvas.getContext('2d')?.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.canvas.setAttribute('aria-label', 'No picture of the camera');
  }

  show({ bitmap, scale, corners, status }: Picture): void {
    const { canvas } = this;
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
    }
    const context = canvas.getContext('2d');
    if (!context) return bitmap.close();
    context.drawImage(bitmap, 0, 0);
    bitmap.close();
    const colour = carriesNumbers(status) ? HELD : NOT_TRUSTED;
    for (const { id, px } of corners) this.outline(context, colour, id, px.map((value) => (value + 0.5) * scale));
    const ids = corners.map(({ id }) => id).join(', ');
    const label = ids ? `Camera picture, tags ${ids} outlined` : 'Camera picture, no tag held';
    if (canvas.getAttribute('aria-label') !== label) canvas.setAttribute('aria-label', label);
  }

  private outline(context: CanvasRenderingContext2D, colour: string, id: number, px: readonly number[]): void {
    context.beginPath();
    for (let i = 0; i < px.length; i += 2) context.lineTo(px[i] ?? 0, px[i + 1] ?? 0);
    context.closePath();
    context.font = '600 18px system-ui, sans-serif';
    for (const [style, width] of [[EDGE, 2 * OUTLINE_PX], [colour, OUTLINE_PX]] as const) {
      context.strokeStyle = style;
      context.lineWidth = width;
      context.stroke();
    }
    context.strokeStyle = EDGE;
    context.strokeText(String(id), (px[0] ?? 0) + 4, (px[1] ?? 0) - 6);
    context.fillStyle = colour;
    context.fillText(String(id), (px[0] ?? 0) + 4, (px[1] ?? 0) - 6);
  }
}
