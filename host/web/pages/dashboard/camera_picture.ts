// What the camera sees, with the tags outlined. Pictures come only while one is looked at.
import { make, present, say } from '../common/elements';
import { colour } from '../common/theme';
import type { Link } from './link';
import type { Picture, PictureHeader } from './protocol';

export class CameraPicture {
  readonly element: HTMLElement;

  private readonly canvas = make('canvas', {
    width: 640,
    height: 480,
    role: 'img',
    'aria-label': 'Camera picture',
  });
  private readonly words = make('p', { class: 'picture-words' }, 'no picture yet');
  private readonly toggle = make('input', { type: 'checkbox' });
  private visible = false;
  private next: Picture | null = null;
  private decoding = false;

  constructor(
    private readonly link: Link,
    label: string,
  ) {
    this.toggle.checked = true;
    const choice = make('label', { class: 'picture-toggle' }, this.toggle, label);
    this.element = make(
      'figure',
      { class: 'camera-picture' },
      make('div', { class: 'picture-frame' }, this.canvas, this.words),
      choice,
    );
    this.toggle.addEventListener('change', () => this.request());
    link.on('picture', (picture) => this.show(picture));
    link.on('hello', (hello) => this.shape(hello.camera.width, hello.camera.height));
  }

  shown(on: boolean): void {
    this.visible = on;
    this.request();
  }

  private request(): void {
    const on = this.visible && this.toggle.checked;
    this.link.wantPictures(this, on);
    if (on) return;
    this.next = null;
    say(this.words, this.toggle.checked ? 'no picture yet' : 'switched off');
    present(this.words, true);
    this.canvas.classList.add('blank');
  }

  private shape(width: number, height: number): void {
    if (width <= 0 || height <= 0 || (this.canvas.width === width && this.canvas.height === height)) return;
    this.canvas.width = width;
    this.canvas.height = height;
  }

  /** The newest wins; one that comes while another is being decoded waits, the one before it is dropped. */
  private show(picture: Picture): void {
    if (!this.visible || !this.toggle.checked) return;
    this.next = picture;
    if (!this.decoding) void this.decode();
  }

  private async decode(): Promise<void> {
    this.decoding = true;
    while (this.next) {
      const { header, jpeg } = this.next;
      this.next = null;
      try {
        const bitmap = await createImageBitmap(jpeg);
        this.draw(bitmap, header);
        bitmap.close();
      } catch {
        say(this.words, 'the picture cannot be read');
        present(this.words, true);
      }
    }
    this.decoding = false;
  }

  private draw(bitmap: ImageBitmap, header: PictureHeader): void {
    this.shape(bitmap.width, bitmap.height);
    const context = this.canvas.getContext('2d');
    if (!context || !this.visible) return;
    context.drawImage(bitmap, 0, 0);
    // Corners are told in the camera's pixels, however small the picture is.
    const scale = header.width > 0 ? bitmap.width / header.width : 1;
    context.lineWidth = Math.max(2, bitmap.width / 240);
    context.strokeStyle = context.fillStyle = colour('--outline');
    context.font = `600 ${Math.round(bitmap.width / 26)}px system-ui, sans-serif`;
    for (const tag of header.tags)
      CameraPicture.outline(
        context,
        tag.px.map((v) => (v + 0.5) * scale),
        tag.id,
      );
    this.canvas.classList.remove('blank');
    present(this.words, false);
  }

  private static outline(context: CanvasRenderingContext2D, px: readonly number[], id: number): void {
    const [x0 = 0, y0 = 0] = px;
    context.beginPath();
    if (px.length >= 6) {
      for (let i = 0; i + 1 < px.length; i += 2) context.lineTo(px[i] ?? 0, px[i + 1] ?? 0);
      context.closePath();
      context.stroke();
      // The first corner, and the name beside it: which way up it was printed.
      context.beginPath();
      context.arc(x0, y0, context.lineWidth * 1.8, 0, 2 * Math.PI);
      context.fill();
      const [width, left] = [
        context.measureText(String(id)).width,
        Math.min(...px.filter((_, i) => i % 2 === 0)),
      ];
      const top = Math.min(...px.filter((_, i) => i % 2 === 1));
      context.fillText(
        String(id),
        Math.max(2, Math.min(context.canvas.width - width - 2, left)),
        Math.max(20, top - 8),
      );
    } else {
      context.arc(x0, y0, context.lineWidth * 1.5, 0, 2 * Math.PI);
      context.stroke();
    }
  }
}
