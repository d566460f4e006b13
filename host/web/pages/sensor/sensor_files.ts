// Files that people choose or drop: which of them is what, and how they go together with the sensor that is in force.
import { isMap, parseDocument } from 'yaml';
import type { SensorFiles } from './messages';

const MOST_BYTES = 8e6;

interface Chosen {
  sensor?: File;
  calibration?: File;
  appearance?: File;
}

function sort(files: readonly File[]): Chosen {
  const chosen: Chosen = {};
  for (const file of files) {
    if (file.size > MOST_BYTES) throw new Error(`${file.name}: larger than any sensor's file; choose sensor.yaml or calibration.json`);
    if (/\.ya?ml$/i.test(file.name)) chosen.sensor = file;
    else if (/\.json$/i.test(file.name)) chosen.calibration = file;
    else if (/\.png$/i.test(file.name)) chosen.appearance = file;
    else throw new Error(`${file.name}: not a sensor's file; choose sensor.yaml, its calibration.json, or both`);
  }
  return chosen;
}

/** `wrench.calibration` in place of a stiffness model: a calibration that was chosen is to be used. */
function pointToCalibration(yaml: string, name: string): string {
  const document = parseDocument(yaml);
  const wrench = document.get('wrench');
  if (document.errors.length > 0 || (isMap(wrench) && wrench.has('calibration'))) return yaml;
  document.setIn(['wrench', 'calibration'], name);
  return document.toString({ lineWidth: 0 });
}

/** Throws an Error with one line for people. */
export async function withFiles(inForce: SensorFiles, files: readonly File[]): Promise<SensorFiles> {
  const { sensor, calibration, appearance } = sort(files);
  const text = sensor ? await sensor.text() : inForce.yaml;
  if (appearance && !text.includes(appearance.name))
    throw new Error(`${appearance.name}: no picture that sensor.yaml names; choose that sensor.yaml with it`);
  const result: SensorFiles = sensor ? { name: sensor.name, yaml: text } : { ...inForce };
  if (calibration) {
    result.calibration = await calibration.text();
    result.yaml = pointToCalibration(result.yaml, calibration.name);
  }
  if (appearance) result.appearance = new Uint8Array(await appearance.arrayBuffer());
  return result;
}
