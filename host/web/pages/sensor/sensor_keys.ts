// The few keys of sensor.yaml that people decide in the page's form: tags, their size, focal length, picture size, mirroring.
// Everything else in the file, comments included, stays as it is. Nothing that was measured is written here.
import { isMap, isSeq, parseDocument } from 'yaml';
import type { MeasuredFiles } from './messages';

export interface SensorKeys {
  family: string;
  ids: string;
  tag_size_mm: number;
  focal_px: number;
  width: number;
  height: number;
  mirrored: boolean;
}

export const FAMILIES: readonly string[] = [
  'aruco_original', 'aruco_4x4_50', 'aruco_4x4_100', 'aruco_4x4_250', 'aruco_4x4_1000', 'aruco_5x5_50', 'aruco_5x5_100',
  'aruco_5x5_250', 'aruco_5x5_1000', 'aruco_6x6_50', 'aruco_6x6_100', 'aruco_6x6_250', 'aruco_6x6_1000', 'aruco_7x7_50',
  'aruco_7x7_100', 'aruco_7x7_250', 'aruco_7x7_1000', 'apriltag_16h5', 'apriltag_25h9', 'apriltag_36h10', 'apriltag_36h11', 'grid_10x10',
];

export function readKeys(yaml: string): SensorKeys {
  const document = parseDocument(yaml);
  const number = (path: string[]): number => Number(document.getIn(path) ?? 0);
  const tags = document.getIn(['target', 'tags']);
  const ids = isSeq(tags) ? tags.items.map((tag) => (isMap(tag) ? String(tag.get('id')) : '?')) : [];
  return {
    family: String(document.getIn(['target', 'family']) ?? ''),
    ids: ids.join(', '),
    tag_size_mm: number(['target', 'tag_size_mm']),
    focal_px: number(['camera', 'fx']),
    width: number(['camera', 'width']),
    height: number(['camera', 'height']),
    mirrored: document.getIn(['camera', 'mirrored']) === true,
  };
}

/** Of what was measured that which holds after the change: nothing of another camera, the camera alone of other tags. */
export function stillMeasured(measured: MeasuredFiles, before: SensorKeys, now: SensorKeys): MeasuredFiles {
  const same = (...keys: (keyof SensorKeys)[]): boolean => keys.every((key) => before[key] === now[key]);
  if (!same('focal_px', 'width', 'height', 'mirrored')) return {};
  if (same('family', 'ids', 'tag_size_mm')) return measured;
  const camera = measured['camera.yaml'];
  return camera ? { 'camera.yaml': camera } : {};
}

/** What was changed, and only that. */
export function writeKeys(yaml: string, before: SensorKeys, now: SensorKeys): string {
  const document = parseDocument(yaml);
  const set = (path: string[], value: unknown): void => document.setIn(path, value);
  if (now.mirrored !== before.mirrored) set(['camera', 'mirrored'], now.mirrored);
  if (now.focal_px !== before.focal_px) {
    set(['camera', 'fx'], now.focal_px);
    set(['camera', 'fy'], now.focal_px);
  }
  if (now.width !== before.width || now.height !== before.height) {
    set(['camera', 'width'], now.width);
    set(['camera', 'height'], now.height);
    set(['camera', 'cx'], (now.width - 1) / 2);
    set(['camera', 'cy'], (now.height - 1) / 2);
  }
  if (now.family !== before.family) set(['target', 'family'], now.family);
  if (now.tag_size_mm !== before.tag_size_mm) set(['target', 'tag_size_mm'], now.tag_size_mm);
  if (now.ids !== before.ids) {
    const ids = now.ids.split(/[\s,;]+/).filter((word) => word !== '').map(Number);
    document.setIn(['target', 'tags'], document.createNode(ids.map((id) => ({ id })), { flow: true }));
  }
  return document.toString({ lineWidth: 0 });
}
