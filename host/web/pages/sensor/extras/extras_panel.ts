// What not everybody has: the bridge's HID device, and the board with its light and load cells. Only there where the browser can.
import { button, field, make, panel, present, say } from '../../common/elements';
import { figure } from '../../common/sample';
import { BoardLink } from './board_link';
import { type BoardNews, PROTOCOL_MAJOR } from './board_messages';
import { HidReadout } from './hid_readout';

const G = 9.80665;
const RESULTS = ['', 'does not know this request', 'cannot read this request', 'cannot do this', 'speaks another version', 'converts nothing there', 'has it already'];
const FAULTS = ['', 'light off: no host', 'light lowered: it gets hot', 'cell does not answer', 'cell is stuck', 'supply is low'];

interface Cell {
  counts: number;
  zero: number;
  /** Of one newton; 0: never weighed. */
  perNewton: number;
  words: HTMLElement;
}

const scaleKey = (channel: number): string => `tagwrench.cell.${channel}`;

export class ExtrasPanel {
  private readonly boardWords = make('p', { class: 'hint', role: 'status' });
  private readonly boardTools = make('div', { hidden: true });
  private readonly light = make('input', { type: 'range', min: 0, max: 1000, step: 10, value: 300 });
  private readonly weight = make('input', { type: 'number', min: 1, max: 5000, step: 'any', value: 50 });
  private readonly cellList = make('div', { class: 'cells' });
  private readonly cells = new Map<number, Cell>();
  private board: BoardLink | null = null;

  constructor(parent: HTMLElement) {
    const body = make('details', {}, make('summary', {}, 'The bridge\'s device, and the board'));
    body.append('hid' in navigator ? new HidReadout().element : make('p', { class: 'hint' }, 'This browser has no WebHID.'));
    body.append('serial' in navigator ? this.boardPart() : make('p', { class: 'hint' }, 'This browser has no WebSerial.'));
    parent.append(panel('More', 'extras-panel', body));
  }

  private boardPart(): HTMLElement {
    this.light.addEventListener('input', () => this.board?.setLight(Number(this.light.value)));
    this.boardTools.append(
      field('Light', this.light),
      make('div', { class: 'row' }, button('Tare cells', () => this.board?.tareAll())),
      field('Known weight, g', this.weight),
      this.cellList,
    );
    const connect = button('Connect the board', () => void this.connect());
    return make('section', { 'aria-label': 'Board' }, make('div', { class: 'row' }, connect), this.boardWords, this.boardTools);
  }

  private async connect(): Promise<void> {
    await this.board?.close();
    try {
      const port = await navigator.serial.requestPort();
      this.board = new BoardLink(port, (news) => this.hear(news), (why) => this.ended(why));
      say(this.boardWords, 'waiting for the board to answer');
      await this.board.open();
    } catch (error) {
      const name = error instanceof Error ? error.name : '';
      if (name === 'NotFoundError') say(this.boardWords, 'no port was chosen');
      else say(this.boardWords, `the port cannot be opened: close what else uses it (the bridge), replug the board (${error instanceof Error ? error.message : String(error)})`);
    }
  }

  private ended(why: string): void {
    say(this.boardWords, why);
    present(this.boardTools, false);
  }

  private hear(news: BoardNews): void {
    switch (news.kind) {
      case 'hello': {
        const fits = news.major === PROTOCOL_MAJOR;
        present(this.boardTools, fits);
        const update = news.major < PROTOCOL_MAJOR ? 'update the board\'s firmware' : 'this page is older than the board';
        say(this.boardWords, fits ? `${news.board}, firmware ${news.firmware}` : update);
        if (fits) this.board?.setLight(Number(this.light.value));
        return;
      }
      case 'cell':
        return this.weigh(news.channel, news.counts, news.saturated);
      case 'tare': {
        const cell = this.cell(news.channel);
        cell.zero = news.mean_counts;
        return;
      }
      case 'answer':
        if (news.result !== 0) say(this.boardWords, `the board ${RESULTS[news.result] ?? 'refused'}`);
        return;
      case 'fault':
        say(this.boardWords, FAULTS[news.code] ?? 'the board reports a fault');
        return;
      case 'status':
        if (news.limited) say(this.boardWords, `light lowered to ${news.led_permille / 10} %: it gets hot`);
        return;
      case 'capabilities':
        return;
    }
  }

  private cell(channel: number): Cell {
    const known = this.cells.get(channel);
    if (known) return known;
    const words = make('span', { class: 'number' });
    const calibrate = button('This is the weight', () => this.calibrate(channel), { title: 'Tare first, then put the known weight on it' });
    this.cellList.append(make('div', { class: 'row' }, `cell ${channel}`, words, calibrate));
    const perNewton = Number(localStorage.getItem(scaleKey(channel)) ?? 0) || 0;
    const cell: Cell = { counts: 0, zero: 0, perNewton, words };
    this.cells.set(channel, cell);
    return cell;
  }

  private weigh(channel: number, counts: number, saturated: boolean): void {
    const cell = this.cell(channel);
    cell.counts = counts;
    const net = counts - cell.zero;
    const newtons = cell.perNewton !== 0 ? `${figure(net / cell.perNewton, 3)} N` : 'not weighed yet';
    say(cell.words, `${newtons} (${net} counts)${saturated ? ', beyond its range' : ''}`);
  }

  private calibrate(channel: number): void {
    const cell = this.cell(channel);
    const newtons = (Number(this.weight.value) / 1e3) * G;
    if (!(newtons > 0) || cell.counts === cell.zero) return say(this.boardWords, 'put the known weight on the cell first, and say how heavy it is');
    cell.perNewton = (cell.counts - cell.zero) / newtons;
    localStorage.setItem(scaleKey(channel), String(cell.perNewton));
  }
}
