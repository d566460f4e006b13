// How it stands, in words and in four figures.
import { button, make, present, say } from '../common/elements';
import { STATUS_WORDS, type Sample } from '../common/sample';
import type { Feed } from './messages';

const FIGURES: readonly [string, string][] = [
  ['rate', 'Pictures that were tracked, a second'],
  ['latency', 'From the browser\'s handing over of a picture to its forces: median. The camera\'s own delay is not in it'],
  ['tracker', 'Time of the tracker alone for a picture: median'],
  ['dropped', 'Pictures that were never looked at'],
];
const EVERY_MS = 250;

export class StatusPanel {
  private readonly status = make('strong', { class: 'status', role: 'status', 'aria-live': 'polite' }, 'not started');
  private readonly hint = make('p', { class: 'hint-words', role: 'status', 'aria-live': 'polite' });
  private readonly mirror: HTMLButtonElement;
  private readonly learning = make('progress', { max: 1, value: 0, 'aria-label': 'Learning the rest pose' });
  private readonly figures: HTMLElement[];
  private readonly source = make('span', { class: 'hint' });
  private shown_ms = Number.NEGATIVE_INFINITY;
  private looking = STATUS_WORDS.acquiring;
  private trouble = '';
  private noticed = '';

  /** `actions` stand first in its line. */
  constructor(parent: HTMLElement, onMirror: () => void, actions: readonly HTMLElement[]) {
    this.mirror = button('My camera is mirrored', onMirror, { hidden: true });
    this.figures = FIGURES.map(([name, title]) => make('span', { class: 'figure number', title }, `${name} –`));
    present(this.learning, false);
    parent.append(
      make('div', { class: 'status-line' }, ...actions, this.status, this.learning, ...this.figures),
      make('div', { class: 'hint-line' }, this.hint, this.mirror), make('p', { class: 'source' }, this.source),
    );
  }

  /** Without pictures. */
  say(text: string): void {
    say(this.status, text);
    this.status.dataset.status = 'none';
    present(this.learning, false);
    this.shown_ms = Number.NEGATIVE_INFINITY;
  }

  /** What the tracker noticed. */
  setHint(text: string, mirrored: boolean): void {
    this.noticed = text;
    present(this.mirror, mirrored);
    this.write();
  }

  /** What is in the way of measuring, beyond what the tracker notices. */
  setTrouble(text: string): void {
    this.trouble = text;
    this.write();
  }

  /** While what finds tags is fetched. */
  setLooking(text: string): void {
    this.looking = text || STATUS_WORDS.acquiring;
  }

  show(sample: Sample, feed: Feed): void {
    const now = performance.now();
    if (now - this.shown_ms < EVERY_MS) return;
    this.shown_ms = now;
    const { learning } = feed;
    const words = sample.status !== 'acquiring' ? STATUS_WORDS[sample.status] : learning ? 'hold still: learning the rest pose' : this.looking;
    say(this.status, words);
    this.status.dataset.status = sample.status;
    present(this.learning, learning !== null);
    if (learning) this.learning.value = learning.done / learning.wanted;
    const values = [
      `rate ${feed.rate_hz.toFixed(1)} Hz`, `latency ${feed.latency_ms.toFixed(1)} ms`,
      `tracker ${feed.track_ms.toFixed(1)} ms`, `dropped ${feed.dropped}`,
    ];
    this.figures.forEach((element, i) => say(element, values[i] ?? ''));
    say(this.source, StatusPanel.words(feed));
  }

  private static words({ path, range, width, height }: Feed): string {
    const size = `${width}×${height}`;
    if (path === 'Y plane') return `${size}, luminance from the camera's Y plane (range ${range})`;
    if (path === 'from colours') return `${size}, luminance computed from colours`;
    return `${size}, by way of a canvas: this browser hands over no video frames. Slower, and the very dark and bright may be cut off`;
  }

  private write(): void {
    say(this.hint, this.trouble || this.noticed);
    this.hint.classList.toggle('error', this.trouble !== '');
  }
}
