// What jobs are called, and how their ends are told: what came of it first, files and reasons after it.
import { type Job, textIn } from './protocol';

const TITLES: Readonly<Record<string, string>> = {
  camera: 'Camera calibration',
  target: 'Target calibration',
  wrench: 'Wrench calibration',
  check: 'Check',
  zero: 'Zero',
  certificate: 'Certificate',
  doctor: 'Doctor',
};
const DONE: Readonly<Record<string, string>> = {
  camera: 'Camera calibration written',
  target: 'Target calibration written',
  wrench: 'Wrench calibration written',
  check: 'Check done',
  zero: 'Zero written',
  certificate: 'Certificate written',
  doctor: 'This computer is examined',
};

export interface Ending {
  what: string;
  /** Files, figures, reasons; may be long, and may be empty. */
  more: string;
  kind: 'news' | 'good' | 'error';
}

export function jobTitle(verb: string): string {
  return TITLES[verb] ?? verb;
}

/** The last thing said of these kinds; empty if there is none. */
export function lastSaid(job: Job, kinds: readonly string[]): string {
  return job.lines.filter((line) => kinds.includes(line.kind)).at(-1)?.text ?? '';
}

/** Null: it runs. */
export function endingOf(job: Job): Ending | null {
  const title = jobTitle(job.verb);
  switch (job.state) {
    case 'running':
      return null;
    case 'done': {
      // Beside a report, a note of the way there would only confuse.
      const note = textIn(job.result?.text) === '' ? lastSaid(job, ['note']) : '';
      const more = (lastSaid(job, ['result']) || note).replace(/^written: /, '');
      return { what: DONE[job.verb] ?? `${title} done`, more, kind: 'good' };
    }
    case 'failed': {
      const why = lastSaid(job, ['warning', 'note', 'result']);
      return {
        what: `${title} failed`,
        more: why || 'It did not say why. Run `tagwrench doctor`.',
        kind: 'error',
      };
    }
    case 'stopped':
      return { what: `${title} stopped`, more: 'What was in force before still is.', kind: 'news' };
  }
}
