// Hands pictures over one at a time. While one is being worked on, a newer one takes the place of the one that waits.

export interface Closable {
  close(): void;
}

export class Newest<Item extends Closable> {
  private waiting: Item | null = null;
  private busy = false;

  /** `work` must not throw; it owns what it is given. */
  constructor(private readonly work: (item: Item) => Promise<void>) {}

  put(item: Item): void {
    this.waiting?.close();
    this.waiting = item;
    if (!this.busy) void this.run();
  }

  clear(): void {
    this.waiting?.close();
    this.waiting = null;
  }

  private async run(): Promise<void> {
    this.busy = true;
    while (this.waiting) {
      const item = this.waiting;
      this.waiting = null;
      await this.work(item);
    }
    this.busy = false;
  }
}
