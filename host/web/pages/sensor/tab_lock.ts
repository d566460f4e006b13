// One tab measures at a time: two would fight for the camera's settings. The one that is told to takes over from the other.

const NAME = 'tagwrench-sensor';

export class TabLock {
  private held = false;

  /** `onLost`: another tab took over. */
  constructor(private readonly onLost: () => void) {}

  /** Whether this tab is the one now. */
  async take(steal = false): Promise<boolean> {
    if (this.held || !('locks' in navigator)) return true;
    return new Promise((done) => {
      const hold = (lock: Lock | null): Promise<void> => {
        this.held = lock !== null;
        done(this.held);
        return lock ? new Promise(() => undefined) : Promise.resolve();
      };
      navigator.locks.request(NAME, steal ? { steal } : { ifAvailable: true }, hold).catch(() => {
        this.held = false;
        this.onLost();
      });
    });
  }
}
