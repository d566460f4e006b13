// Where the arrow of a force lies in the platform's picture; and what of that picture is seen from every side. m.
import { type Matrix4, Vector3 } from 'three';

/** From the eye to what it looks at, at first. */
export const START_DISTANCE = 0.16;
/** Of the picture, from its lower to its upper edge. */
export const FIELD_DEG = 38;
/** What moves is shown moved no farther. */
export const FARTHEST_MOVE = 0.008;
/** Cone beyond the shaft's end. */
export const TIP_LENGTH = 0.0045;
/** On the knob, where they are seen. */
export const ARROW_FOOT = 0.0055;

/** Stronger pushes are no longer than this part of full scale. */
const MOST_PART = 1.5;
const LEAST_LENGTH = 0.006;
/** A sphere of this radius is in the picture from every side, and a little beyond. */
const SEEN_RADIUS = 0.95 * START_DISTANCE * Math.sin((FIELD_DEG / 2) * (Math.PI / 180));
const MOST_LENGTH = SEEN_RADIUS - FARTHEST_MOVE - ARROW_FOOT - TIP_LENGTH - 0.001;

export interface ForceArrow {
  foot: Vector3;
  along: Vector3;
  /** Of the shaft. */
  length: number;
}

/** `part`: of full scale. A pull begins at the knob; a push ends there, or the platform would hide it. */
export function forceArrow(force: Vector3, part: number, platform: Matrix4): ForceArrow {
  const length = LEAST_LENGTH + (Math.min(MOST_PART, part) / MOST_PART) * (MOST_LENGTH - LEAST_LENGTH);
  const along = force.clone().normalize();
  const outside = Math.max(0, Math.min(1, -2 * along.z)) * (length + TIP_LENGTH);
  const foot = new Vector3(0, 0, ARROW_FOOT).applyMatrix4(platform).addScaledVector(along, -outside);
  return { foot, along, length };
}
