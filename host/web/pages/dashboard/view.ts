// What every view of the dashboard is, and what it is given.
import type { Link } from './link';
import type { Answer } from './protocol';

export interface View {
  /** Its name in the address: #live. */
  readonly name: string;
  readonly title: string;
  readonly element: HTMLElement;
  /** Comes into sight, or leaves it. */
  shown?(on: boolean): void;
}

export interface App {
  readonly link: Link;
  readonly token: string;
  /** A line for people, at the bottom of the page and for screen readers. */
  tell(text: string, kind?: 'news' | 'good' | 'error'): void;
  /** Asks, and tells what came of it. */
  request(what: string, extra?: Readonly<Record<string, unknown>>): Promise<Answer>;
  /** As request(); `words` are made of what the bridge answers when it did it, empty: nothing is told then. */
  wishSaying(
    words: (text: string) => string,
    what: string,
    extra?: Readonly<Record<string, unknown>>,
  ): Promise<Answer>;
  /** Begins a job; its end will be told. */
  begin(verb: string, options: Readonly<Record<string, unknown>>): Promise<void>;
  /** Puts away the job that has ended. */
  close(): Promise<void>;
}
