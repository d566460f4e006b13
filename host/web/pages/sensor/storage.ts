// What is remembered between visits: the sensor's files and the choice of camera. Storage may be forbidden or full; then things
// last as long as the page.
import type { CameraRequest } from './camera';
import type { SensorFiles } from './messages';

const DATABASE = 'tagwrench';
const STORE = 'sensor';
const KEY = 'files';
const CAMERA = 'tagwrench.camera';

function open(): Promise<IDBDatabase> {
  return new Promise((done, failed) => {
    const request = indexedDB.open(DATABASE, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(STORE);
    request.onsuccess = () => done(request.result);
    request.onerror = () => failed(request.error ?? new Error('no storage'));
    request.onblocked = () => failed(new Error('storage is in use'));
  });
}

async function ask<Answer>(mode: IDBTransactionMode, what: (store: IDBObjectStore) => IDBRequest<Answer>): Promise<Answer> {
  const database = await open();
  try {
    return await new Promise((done, failed) => {
      const request = what(database.transaction(STORE, mode).objectStore(STORE));
      request.onsuccess = () => done(request.result);
      request.onerror = () => failed(request.error ?? new Error('no storage'));
    });
  } finally {
    database.close();
  }
}

function isFiles(value: unknown): value is SensorFiles {
  const files = value as Partial<SensorFiles> | undefined;
  return typeof files?.name === 'string' && typeof files.yaml === 'string';
}

export async function storedFiles(): Promise<SensorFiles | null> {
  try {
    const value = await ask<unknown>('readonly', (store) => store.get(KEY));
    return isFiles(value) ? value : null;
  } catch {
    return null;
  }
}

/** Whether it is kept. */
export async function storeFiles(files: SensorFiles | null): Promise<boolean> {
  try {
    if (files) await ask('readwrite', (store) => store.put(files, KEY));
    else await ask('readwrite', (store) => store.delete(KEY));
    return true;
  } catch {
    return false;
  }
}

export function storedRequest(otherwise: CameraRequest): CameraRequest {
  try {
    const said = JSON.parse(localStorage.getItem(CAMERA) ?? '{}') as Partial<CameraRequest>;
    const number = (value: unknown, usual: number): number =>
      typeof value === 'number' && value > 0 && value < 1e4 ? value : usual;
    return {
      deviceId: typeof said.deviceId === 'string' ? said.deviceId : otherwise.deviceId,
      width: number(said.width, otherwise.width),
      height: number(said.height, otherwise.height),
      rate_hz: number(said.rate_hz, otherwise.rate_hz),
    };
  } catch {
    return otherwise;
  }
}

export function storeRequest(request: CameraRequest): void {
  try {
    localStorage.setItem(CAMERA, JSON.stringify(request));
  } catch {
    // Not remembered, which is all.
  }
}
