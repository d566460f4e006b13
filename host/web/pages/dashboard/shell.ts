// The frame round the views: name, connection and status above, the way between views, the latest news below.
// Nothing of it moves when words change: each has its room, and a banner lies over the view's end.
import { button, make, present, say } from '../common/elements';
import { STATUS_WORDS, type Status } from '../common/sample';
import { themeSwitch } from '../common/theme';
import type { Link, LinkState } from './link';
import { endingOf, jobTitle } from './job_words';
import type { Answer, BridgeState, Hello, Job } from './protocol';
import { duration } from './words';
import type { App, View } from './view';

const MOST_LINES = 100;

export class Shell implements App {
  private readonly views: View[] = [];
  private readonly nav = make('nav', { 'aria-label': 'Views' });
  private readonly main = make('main', { id: 'main', tabindex: -1 });
  private readonly name = make('span', { class: 'sensor-name' });
  private readonly linkDot = make('i', { class: 'dot', 'aria-hidden': true });
  private readonly linkWords = make('span', {}, 'connecting');
  private readonly status = make('output', { class: 'status', role: 'status', 'aria-live': 'polite' });
  private readonly recording = make(
    'a',
    { class: 'badge recording', href: '#record', hidden: true },
    'recording',
  );
  private readonly job = make('a', { class: 'badge', href: '#calibrate', hidden: true });
  private readonly banner = make('div', { class: 'banner', role: 'alert', hidden: true });
  private readonly newest = make('span', { class: 'newest', role: 'status', 'aria-live': 'polite' });
  private readonly lines = make('ol', { class: 'lines', hidden: true, 'aria-label': 'Messages' });
  private stopped = false;
  /** A job runs, as far as this page has heard. */
  private awaiting = false;
  private current: View | null = null;
  private waiting: ReturnType<typeof setInterval> | undefined;

  constructor(
    readonly link: Link,
    readonly token: string,
  ) {
    const connection = make(
      'span',
      { class: 'connection', 'aria-live': 'polite' },
      this.linkDot,
      this.linkWords,
    );
    const title = make('h1', {}, 'tagwrench ', this.name);
    const header = make(
      'header',
      {},
      title,
      make('div', { class: 'status-slot' }, this.status),
      make('div', { class: 'badges' }, this.job, this.recording),
      connection,
      themeSwitch(),
    );
    document.body.append(
      make('a', { class: 'skip', href: '#main' }, 'Skip to the content'),
      header,
      this.nav,
      this.main,
      this.footer(),
    );
    document.querySelector('.skip')?.addEventListener('click', (event) => {
      event.preventDefault();
      this.main.focus();
    });
    link.on('link', (state) => this.showLink(state));
    link.on('hello', (hello) => this.showHello(hello));
    link.on('state', (state) => this.showState(state));
    link.on('job', (job) => {
      if (this.link.state) this.showState(this.link.state);
      else this.follow(job);
    });
    link.on('line', (line) => this.tell(line));
    addEventListener('hashchange', () => this.go());
    document.addEventListener('keydown', (event) => this.key(event));
  }

  add(view: View): void {
    this.views.push(view);
    view.element.classList.add('view', `view-${view.name}`);
    this.nav.append(make('a', { href: `#${view.name}` }, view.title));
  }

  start(): void {
    this.go();
  }

  tell(text: string, kind: 'news' | 'good' | 'error' = 'news'): void {
    if (text === '') return;
    this.newest.className = `newest ${kind}`;
    say(this.newest, text);
    const time = new Date().toLocaleTimeString([], { hour12: false });
    this.lines.prepend(make('li', { class: kind }, make('time', { class: 'number' }, time), ` ${text}`));
    while (this.lines.childElementCount > MOST_LINES) this.lines.lastElementChild?.remove();
  }

  async request(what: string, extra: Readonly<Record<string, unknown>> = {}): Promise<Answer> {
    return this.wishSaying((text) => text, what, extra);
  }

  async wishSaying(
    words: (text: string) => string,
    what: string,
    extra: Readonly<Record<string, unknown>> = {},
  ): Promise<Answer> {
    const answer = await this.link.ask(what, extra);
    this.tell(answer.ok ? words(answer.text) : answer.text, answer.ok ? 'good' : 'error');
    return answer;
  }

  async begin(verb: string, options: Readonly<Record<string, unknown>>): Promise<void> {
    const begun = (): string => `${jobTitle(verb)} begun`;
    const answer = await this.wishSaying(begun, 'job_start', { verb, options });
    // What comes after the answer is of this job, and it may have ended already.
    if (answer.ok) this.awaiting = true;
  }

  async close(): Promise<void> {
    await this.wishSaying(() => '', 'job_close');
  }

  private footer(): HTMLElement {
    const toggle = button(
      'Messages',
      () => {
        const open = toggle.getAttribute('aria-expanded') !== 'true';
        toggle.setAttribute('aria-expanded', String(open));
        present(this.lines, open);
      },
      { class: 'quiet', 'aria-expanded': 'false' },
    );
    return make('footer', {}, this.banner, this.lines, make('div', { class: 'news' }, this.newest, toggle));
  }

  private go(): void {
    const wanted = location.hash.slice(1).split('/')[0];
    const view = this.views.find((one) => one.name === wanted) ?? this.views[0];
    if (!view || view === this.current) return;
    this.current?.shown?.(false);
    this.current = view;
    this.main.replaceChildren(view.element);
    for (const entry of this.nav.querySelectorAll('a')) {
      if (entry.getAttribute('href') === `#${view.name}`) {
        entry.setAttribute('aria-current', 'page');
        entry.scrollIntoView({ block: 'nearest', inline: 'nearest' });
      } else {
        entry.removeAttribute('aria-current');
      }
    }
    document.title = `${view.title} · tagwrench`;
    view.shown?.(true);
  }

  /** 0 zeroes, wherever nothing is being typed. */
  private key(event: KeyboardEvent): void {
    const typing = event.target instanceof HTMLElement && event.target.matches('input, select, textarea');
    if (typing || event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
    if (event.key === '0') void this.request('zero');
  }

  private showLink(state: LinkState): void {
    clearInterval(this.waiting);
    this.linkDot.className = `dot ${state.kind}`;
    document.body.classList.toggle('offline', state.kind !== 'open');
    if (state.kind === 'open') {
      say(this.linkWords, 'connected');
      present(this.banner, false);
      this.stopped = false;
    } else if (state.kind === 'older') {
      this.warn(
        'This page is older than the bridge. ',
        button('Reload', () => location.reload()),
      );
      say(this.linkWords, 'page too old');
    } else if (state.kind === 'waiting') {
      say(this.linkWords, 'not connected');
      if (state.refused) this.warn(Shell.refusedWords());
      else this.warnGone(state.since);
    }
    if (state.kind !== 'open') say(this.status, '');
  }

  /** The bridge is there, but its sensor is not. */
  private showStopped(stopped: boolean, why: string): void {
    if (stopped === this.stopped) return;
    this.stopped = stopped;
    if (stopped)
      this.warn(
        `The sensor does not run: ${why} `,
        button('Try again', () => void this.request('retry')),
      );
    else present(this.banner, false);
  }

  private static refusedWords(): string {
    return (
      'The bridge answers, but does not let this page in. Open the address that tagwrench printed when it started (with ' +
      '#token=… at its end; the token is in the file given as --web-token). If that is the one, too many pages are open: close some.'
    );
  }

  private warnGone(since: Date): void {
    const words = make('span');
    const show = (): void => {
      say(
        words,
        `No bridge since ${since.toLocaleTimeString([], { hour12: false })} (${duration((Date.now() - since.getTime()) / 1e3)}). ` +
          'What is shown is old. Is `tagwrench run` still running? This page connects again by itself.',
      );
    };
    show();
    this.waiting = setInterval(show, 1000);
    this.warn(words);
  }

  private warn(...words: (Node | string)[]): void {
    this.banner.replaceChildren(...words);
    present(this.banner, true);
  }

  private showHello(hello: Hello): void {
    say(this.name, hello.name === 'sensor' ? '' : hello.name);
    this.name.title = `${hello.source}; ${hello.sensor}; version ${hello.version}`;
  }

  private showState(state: BridgeState): void {
    const words = STATUS_WORDS[state.status as Status] ?? state.status;
    const why = state.words !== '' && state.words !== 'held' ? state.words : words;
    const lent = !state.running && state.job?.state === 'running';
    this.status.className = `status ${lent ? 'acquiring' : state.status}`;
    say(this.status, lent ? 'the camera is in use' : why);
    this.status.title = this.status.textContent;
    this.showStopped(!state.running && !lent && !state.settingUp, state.words);
    present(this.recording, state.recording !== null);
    if (state.recording) say(this.recording, `recording ${duration(state.recording.seconds)}`);
    present(this.job, state.job?.state === 'running');
    if (state.job) {
      this.job.href =
        state.job.verb === 'doctor' || state.job.verb === 'certificate' ? `#${state.job.verb}` : '#calibrate';
      say(this.job, `${state.job.verb} runs`);
    }
    this.follow(state.job);
  }

  /** Tells a job's end, once, to pages that heard of its beginning. */
  private follow(job: Job | null): void {
    const ending = job ? endingOf(job) : null;
    if (ending && this.awaiting) this.tell([ending.what, ending.more].filter(Boolean).join(': '), ending.kind);
    this.awaiting = job !== null && ending === null;
  }
}
