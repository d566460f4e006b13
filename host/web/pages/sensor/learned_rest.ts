// What the tracker learned at rest, written into a sensor.yaml the way `tagwrench calibrate target` does: the same
// keys, and all else and the comments stay.
import { isMap, isSeq, parseDocument, type Document, type YAMLMap } from 'yaml';

interface Pose {
  position_mm: number[];
  rotation_rad: number[];
}

/** As the core says it. */
export interface Learned {
  rest: Pose;
  tags: (Pose & { id: number })[];
  /** Rest is as sensor.yaml gives it; nothing was learned. */
  given: boolean;
  /** sensor.yaml has a zero, found at an earlier rest. */
  zero_set: boolean;
}

const rounded = (values: number[], digits: number): number[] => values.map((value) => Number(value.toFixed(digits)));

function setPose(document: Document, map: YAMLMap, pose: Pose): void {
  const flow = (values: number[]) => document.createNode(values, { flow: true });
  map.set('position_mm', flow(rounded(pose.position_mm, 6)));
  map.set('rotation_rad', flow(rounded(pose.rotation_rad, 7)));
}

/** Throws an Error while nothing has been learned. */
export function withLearned(yaml: string, learned: Learned | null): string {
  if (!learned) throw new Error('the rest pose is not known yet; let the platform stand still before the camera');
  if (learned.given) return yaml;
  const document = parseDocument(yaml);
  const tags = document.getIn(['target', 'tags']);
  if (!isSeq(tags)) throw new Error('target.tags is no list; choose another sensor.yaml');
  tags.items.forEach((item, index) => {
    const tag = learned.tags[index];
    if (!isMap(item) || !tag) return;
    setPose(document, item, tag);
    item.delete('position_sigma_mm'); // of another measurement
    item.delete('rotation_sigma_rad');
  });
  if (!isMap(document.get('rest'))) document.set('rest', document.createNode({}));
  const rest = document.get('rest');
  if (isMap(rest)) {
    setPose(document, rest, learned.rest);
    rest.delete('appearance');
  }
  if (learned.zero_set) {
    for (const key of ['zero_n', 'zero_nm', 'zero_date']) document.deleteIn(['wrench', key]);
  }
  return document.toString({ lineWidth: 0 });
}
