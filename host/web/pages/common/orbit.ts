// Turns a camera round the origin by pointer, wheel and keys. Up stays up (z).
import { type PerspectiveCamera } from 'three';
import { START_DISTANCE } from './force_arrow';

const START = { azimuth: -1.15, height: 0.5, distance: START_DISTANCE };
const CENTRE_Z = -0.001;
const LOWEST = -0.35;
const HIGHEST = 1.5;

export class Orbit {
  private azimuth = START.azimuth;
  private height = START.height;
  private distance = START.distance;

  constructor(
    private readonly camera: PerspectiveCamera,
    element: HTMLElement,
    private readonly onMove: () => void,
  ) {
    element.tabIndex = 0;
    element.addEventListener('pointerdown', (event) => this.drag(element, event));
    element.addEventListener('keydown', (event) => this.key(event));
    element.addEventListener(
      'wheel',
      (event) => {
        // The page scrolls as ever; with Ctrl the picture comes nearer.
        if (!event.ctrlKey) return;
        event.preventDefault();
        this.turn(0, 0, event.deltaY > 0 ? 1.1 : 1 / 1.1);
      },
      { passive: false },
    );
    this.turn(0, 0, 1);
  }

  private drag(element: HTMLElement, down: PointerEvent): void {
    let [x, y] = [down.clientX, down.clientY];
    const ends = new AbortController();
    const end = (): void => ends.abort();
    element.setPointerCapture(down.pointerId);
    element.addEventListener(
      'pointermove',
      (event) => {
        this.turn((x - event.clientX) * 0.01, (event.clientY - y) * 0.01, 1);
        [x, y] = [event.clientX, event.clientY];
      },
      { signal: ends.signal },
    );
    element.addEventListener('pointerup', end, { signal: ends.signal });
    element.addEventListener('pointercancel', end, { signal: ends.signal });
  }

  private key(event: KeyboardEvent): void {
    const turns: Readonly<Record<string, readonly [number, number, number]>> = {
      ArrowLeft: [-0.1, 0, 1],
      ArrowRight: [0.1, 0, 1],
      ArrowUp: [0, 0.1, 1],
      ArrowDown: [0, -0.1, 1],
      '+': [0, 0, 1 / 1.1],
      '-': [0, 0, 1.1],
    };
    const turn = turns[event.key];
    if (event.key === 'Home')
      ({ azimuth: this.azimuth, height: this.height, distance: this.distance } = START);
    if (!turn && event.key !== 'Home') return;
    event.preventDefault();
    this.turn(...(turn ?? [0, 0, 1]));
  }

  private turn(round: number, up: number, farther: number): void {
    this.azimuth += round;
    this.height = Math.max(LOWEST, Math.min(HIGHEST, this.height + up));
    this.distance = Math.max(0.08, Math.min(0.4, this.distance * farther));
    const flat = Math.cos(this.height) * this.distance;
    this.camera.position.set(
      Math.cos(this.azimuth) * flat,
      Math.sin(this.azimuth) * flat,
      Math.sin(this.height) * this.distance,
    );
    this.camera.up.set(0, 0, 1);
    this.camera.lookAt(0, 0, CENTRE_Z);
    this.onMove();
  }
}
