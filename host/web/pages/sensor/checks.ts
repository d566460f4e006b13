// What this page needs of a browser, and what to do where it is missing.
import { checkWebAssembly } from './wasm_support';

export interface Trouble {
  title: string;
  advice: string;
}

const NEWER = 'Use Chrome, Edge or another Chromium from version 123, Firefox from 120 or Safari from 17.5.';

/** Whether workers can be modules: the browser reads `type` only if it knows it. */
function hasModuleWorkers(): boolean {
  let read = false;
  const probe = {
    get type(): WorkerType {
      read = true;
      return 'module';
    },
  };
  new Worker('./probe.js', probe).terminate();
  return read;
}

/** What is in the way of a camera, or null. */
export function firstCameraTrouble(): Trouble | null {
  if (!window.isSecureContext) {
    const local = `http://localhost:${location.port || '80'}${location.pathname}`;
    return {
      title: 'The browser gives no camera to this address',
      advice:
        `Cameras are for https:// and for this computer alone, and this page came from ${location.origin}. ` +
        `Open it by https://, or on the computer that serves it as ${local}`,
    };
  }
  if (!navigator.mediaDevices?.getUserMedia) {
    return { title: 'This browser has no access to cameras', advice: NEWER };
  }
  return null;
}

/** The first thing that is in the way of measuring, or null. */
export function firstTrouble(): Trouble | null {
  const trouble = firstCameraTrouble();
  if (trouble) return trouble;
  try {
    checkWebAssembly();
  } catch (error) {
    const line = error instanceof Error ? error.message : String(error);
    return {
      title: 'The tracker does not run in this browser',
      advice: `${line}. If it is a new one: WebAssembly may be switched off in its settings.`,
    };
  }
  if (!hasModuleWorkers()) return { title: 'This browser runs no modules in workers', advice: NEWER };
  return null;
}

/** What a refused or broken camera means, in words. */
export function cameraTrouble(error: unknown): Trouble {
  const name = error instanceof Error ? error.name : '';
  switch (name) {
    case 'NotFoundError':
    case 'DevicesNotFoundError':
      return { title: 'No camera is there', advice: 'Plug one in: it is opened by itself.' };
    case 'NotAllowedError':
    case 'SecurityError':
      return {
        title: 'The camera was refused',
        advice:
          'Allow it in the browser\'s address bar (the camera or lock symbol), then press Start. If it was never asked, ' +
          'the system\'s privacy settings may forbid it, or the page is framed by another.',
      };
    case 'NotReadableError':
    case 'TrackStartError':
    case 'AbortError':
      return {
        title: 'The camera is in use, or does not answer',
        advice: 'Close other programs and tabs that show its picture (a bridge that runs, too), replug it, then press Start.',
      };
    case 'OverconstrainedError':
      return { title: 'The camera has no such mode', advice: 'Choose another size and rate, or another camera.' };
    default:
      return { title: 'The camera cannot be opened', advice: error instanceof Error ? error.message : String(error) };
  }
}
