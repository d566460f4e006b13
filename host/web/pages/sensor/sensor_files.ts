// Files that people choose or drop: which of them is what, and how they go together with the sensor that is in force.
import { isMap, parseDocument } from 'yaml';
import { MEASURED_NAMES, type MeasuredFiles, type MeasuredName, type SensorFiles } from './messages';

const MOST_BYTES = 8e6;
const WANTED = 'choose sensor.yaml, the files of its measured/, or both';

interface Chosen {
  sensor?: { file: File; text: string };
  calibration?: Uint8Array;
  appearance?: { name: string; bytes: Uint8Array };
  measured: MeasuredFiles;
}

/** What a YAML file tells by its keys, whatever it is called; null: a sensor. */
function measuredName(text: string): MeasuredName | null {
  const document = parseDocument(text);
  if (document.errors.length > 0 || !isMap(document.contents)) return null;
  if (document.has('camera_matrix')) return 'camera.yaml';
  const format = String(document.get('format') ?? '');
  if (format.startsWith('tagwrench-target-')) return 'target.yaml';
  if (format.startsWith('tagwrench-zero-')) return 'zero.yaml';
  return null;
}

const bytesOf = async (file: File): Promise<Uint8Array> => new Uint8Array(await file.arrayBuffer());

async function sort(files: readonly File[]): Promise<Chosen> {
  const chosen: Chosen = { measured: {} };
  for (const file of files) {
    if (file.size > MOST_BYTES) throw new Error(`${file.name}: larger than any sensor's file; ${WANTED}`);
    if (/\.ya?ml$/i.test(file.name)) {
      const text = await file.text();
      const name = measuredName(text);
      if (name) chosen.measured[name] = await bytesOf(file);
      else chosen.sensor = { file, text };
    } else if (/\.json$/i.test(file.name)) chosen.calibration = await bytesOf(file);
    else if (/\.(png|rest)$/i.test(file.name)) chosen.appearance = { name: file.name, bytes: await bytesOf(file) };
    else throw new Error(`${file.name}: not a sensor's file; ${WANTED}`);
  }
  return chosen;
}

/** The file that sensor.yaml names there, as earlier versions had it. */
function named(yaml: string, section: string, key: string): string {
  const document = parseDocument(yaml);
  const map = document.errors.length > 0 ? null : document.get(section);
  return isMap(map) ? String(map.get(key) ?? '') : '';
}

/** Throws an Error with one line for people. */
export async function withFiles(inForce: SensorFiles, files: readonly File[]): Promise<SensorFiles> {
  const { sensor, calibration, appearance, measured } = await sort(files);
  const result: SensorFiles = sensor ? { name: sensor.file.name, yaml: sensor.text } : { ...inForce };
  const all: MeasuredFiles = { ...result.measured, ...measured };
  if (calibration) {
    if (named(result.yaml, 'wrench', 'calibration') === '') all['wrench.json'] = calibration;
    else result.calibration = new TextDecoder().decode(calibration);
  }
  if (appearance) {
    const target = all['target.yaml'];
    if (target && new TextDecoder().decode(target).includes(appearance.name)) all['rest.png'] = appearance.bytes;
    else if (result.yaml.includes(appearance.name)) result.appearance = appearance.bytes;
    else throw new Error(`${appearance.name}: no picture that target.yaml or sensor.yaml names; choose that file with it`);
  }
  if (MEASURED_NAMES.some((name) => all[name])) result.measured = all;
  return result;
}
