// A profile's YAML: what can be moved in it, and the text with something moved. Comments and order stay.
import { type Document, isMap, isScalar, isSeq, parseDocument } from 'yaml';

export const PROFILE_AXES = ['x', 'y', 'z', 'rx', 'ry', 'rz'] as const;
export type ProfileAxis = (typeof PROFILE_AXES)[number];

export interface CurveOf {
  power: number;
  /** Instead of a power. */
  points: readonly (readonly [number, number])[] | null;
}

/** One axis as the profile has it; SI. */
export interface AxisShape {
  axis: ProfileAxis;
  /** Axis of the wrench that feeds it, 0..5. */
  source: number;
  invert: boolean;
  limit: number;
  full: number;
  dead: number;
  release: number;
  gain: number;
  curve: CurveOf;
}

export type Path = readonly string[];

export class ProfileText {
  private readonly document: Document;

  constructor(text: string) {
    this.document = parseDocument(text);
  }

  get broken(): boolean {
    return this.document.errors.length > 0 || !isMap(this.document.contents);
  }

  number(path: Path, otherwise: number): number {
    const value = Number(this.document.getIn(path));
    return this.document.hasIn(path) && Number.isFinite(value) ? value : otherwise;
  }

  text(path: Path, otherwise: string): string {
    const value: unknown = this.document.getIn(path);
    return typeof value === 'string' ? value : otherwise;
  }

  flag(path: Path, otherwise: boolean): boolean {
    const value: unknown = this.document.getIn(path);
    return typeof value === 'boolean' ? value : otherwise;
  }

  has(path: Path): boolean {
    return this.document.hasIn(path);
  }

  /** The text with other values at these places. */
  with(changes: readonly (readonly [Path, number | string | boolean])[]): string {
    const changed = this.document.clone();
    for (const [path, value] of changes) {
      // A scalar in its place keeps the comment beside it.
      const node = changed.getIn(path, true);
      if (isScalar(node)) node.value = value;
      else changed.setIn(path, value);
    }
    return changed.toString({ lineWidth: 0, flowCollectionPadding: false });
  }

  shape(axis: ProfileAxis): AxisShape {
    const at = PROFILE_AXES.indexOf(axis);
    const source = Math.max(
      0,
      PROFILE_AXES.findIndex((name) => name === this.text(['axes', axis, 'from'], axis)),
    );
    const unit = source < 3 ? 'n' : 'nm';
    return {
      axis,
      source,
      invert: this.flag(['axes', axis, 'invert'], false),
      limit: this.number(['axes', axis, 'limit'], 1),
      full: this.number(['axes', axis, `full_scale_${unit}`], Number.NaN),
      dead: this.number(['axes', axis, `dead_zone_${unit}`], Number.NaN),
      release: this.number(['dead_zone_release'], 0.7),
      gain: this.number([at < 3 ? 'translation' : 'rotation'], 1),
      curve: this.curve(['axes', axis, 'curve']),
    };
  }

  private curve(path: Path): CurveOf {
    const from = this.document.hasIn(path) ? path : ['curve'];
    const points = this.document.getIn([...from, 'points'], true);
    if (!isSeq(points)) return { power: this.number([...from, 'power'], 1), points: null };
    const pairs = (points.toJSON() as unknown[]).filter(
      (pair): pair is [number, number] =>
        Array.isArray(pair) && pair.length === 2 && pair.every((v) => typeof v === 'number'),
    );
    return pairs.length >= 2 ? { power: 1, points: pairs } : { power: 1, points: null };
  }
}
