// The black or white patch that fills the page. It changes with the screen's refresh and never more often than it is allowed to.
import { make } from '../common/elements';

export class Patch {
  readonly element = make('div', { class: 'patch', hidden: true });
  /** Changes since it was shown. */
  flips = 0;
  private white = false;
  private changed_ms = Number.NEGATIVE_INFINITY;

  constructor(parent: HTMLElement, private readonly shortest_ms: () => number) {
    parent.append(this.element);
  }

  present(on: boolean): void {
    this.element.hidden = !on;
    this.flips = 0;
    this.paint(false);
  }

  get isWhite(): boolean {
    return this.white;
  }

  /** At the first refresh of the screen from `when_ms` on that is not too soon after the last change; resolves with its time. */
  flip(white: boolean, when_ms: number): Promise<number> {
    return new Promise((done) => {
      const look = (now_ms: number): void => {
        if (now_ms < Math.max(when_ms, this.changed_ms + this.shortest_ms())) {
          requestAnimationFrame(look);
          return;
        }
        this.paint(white);
        done(performance.now());
      };
      requestAnimationFrame(look);
    });
  }

  private paint(white: boolean): void {
    if (white !== this.white) {
      this.flips++;
      this.changed_ms = performance.now();
    }
    this.white = white;
    this.element.dataset.white = String(white);
  }
}
