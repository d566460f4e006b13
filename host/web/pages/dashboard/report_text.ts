// The lines that `doctor` and `check` print, with their marks as colours and words.
import { make } from '../common/elements';

interface Mark {
  pattern: RegExp;
  name: string;
  sign: string;
  /** For those who do not see the sign. */
  spoken: string;
}

const MARKS: readonly Mark[] = [
  { pattern: /^(ok|fine)\s+/, name: 'good', sign: '\u2713', spoken: 'fine: ' },
  { pattern: /^--\s+/, name: 'note', sign: '\u2013', spoken: 'note: ' },
  { pattern: /^(!!|OFF)\s+/, name: 'error', sign: '!', spoken: 'to do: ' },
];

export function reportLines(text: string): HTMLElement[] {
  return text
    .trimEnd()
    .split('\n')
    .map((line) => {
      const mark = MARKS.find(({ pattern }) => pattern.test(line));
      const words = mark ? line.replace(mark.pattern, '') : line;
      const sign = make('span', { class: 'sign', 'aria-hidden': true }, mark?.sign ?? '');
      const spoken = make('span', { class: 'unseen' }, mark?.spoken ?? '');
      // What `check` looked at stands in a column of its own.
      const [, name, rest] = words.match(/^(\S+)\s{2,}(.*)$/) ?? [];
      const body =
        name !== undefined && rest !== undefined
          ? [make('span', { class: 'report-name' }, `${name} `), rest]
          : [words || '\u00a0'];
      return make(
        'div',
        { class: `report-line ${mark?.name ?? ''}`.trim() },
        sign,
        make('span', { class: 'report-words' }, spoken, ...body),
      );
    });
}
