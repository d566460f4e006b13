// A profile's YAML: what can be moved in it, and the text with something moved. Comments and order stay.
import { CST, Composer, type Document, Parser, isMap, isScalar, isSeq, parseDocument } from 'yaml';

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
type Change = readonly [Path, unknown];
type Mapping = Readonly<Record<string, unknown>>;

const isMapping = (value: unknown): value is Mapping =>
  typeof value === 'object' && value !== null && !Array.isArray(value);
const sameText = (a: unknown, b: unknown): boolean => JSON.stringify(a) === JSON.stringify(b);

/** What differs, down to where the keys do. */
function changesBetween(was: unknown, wanted: unknown, path: Path = []): Change[] {
  if (sameText(was, wanted)) return [];
  if (!isMapping(was) || !isMapping(wanted) || !sameText(Object.keys(was), Object.keys(wanted)))
    return [[path, wanted]];
  return Object.entries(wanted).flatMap(([key, value]) => changesBetween(was[key], value, [...path, key]));
}

/** One curve for all axes, where they have the same: so people write it. */
function withOneCurve(changes: readonly Change[], wanted: unknown): readonly Change[] {
  const axes = isMapping(wanted) && isMapping(wanted['axes']) ? Object.values(wanted['axes']) : [];
  const [curve, ...others] = axes.map((axis) => (isMapping(axis) ? axis['curve'] : undefined));
  const ofCurves = ([path]: Change): boolean => path[0] === 'axes' && path[2] === 'curve';
  if (!changes.some(ofCurves) || !others.every((other) => sameText(other, curve))) return changes;
  return [...changes.filter((change) => !ofCurves(change)), [['curve'], curve]];
}

/**
 * `file`, the text that a person wrote, saying what `wanted` says and `was` does not; both are texts of whole profiles. Values
 * that stand there already are changed to the letter, all else stays; where keys are missing, blanks may change, comments not.
 * A file that cannot take a change becomes `wanted`.
 */
export function withChanges(file: string, was: string, wanted: string): string {
  const meant: unknown = parseDocument(wanted).toJS();
  const changes = withOneCurve(changesBetween(parseDocument(was).toJS(), meant), meant);
  const tokens = [...new Parser().parse(file)];
  const [written] = new Composer({ keepSourceTokens: true }).compose(tokens);
  const missing = changes.filter(([path, value]) => {
    const token = written?.getIn(path, true);
    if (!isScalar(token) || !token.srcToken || typeof value === 'object') return true;
    CST.setScalarValue(token.srcToken, String(value));
    return false;
  });
  const placed = tokens.map((token) => CST.stringify(token)).join('');
  if (missing.length === 0) return placed;
  const document = parseDocument(placed);
  for (const [path, value] of missing) {
    const above = path.map((_, depth) => document.getIn(path.slice(0, depth), true));
    if (!above.every((node) => node === undefined || isMap(node))) return wanted; // an alias, or nothing, where a mapping belongs
    const node = document.createNode(value, { flow: true });
    const old = document.getIn(path, true);
    if (isScalar(old) || isMap(old)) node.comment = old.comment ?? null;
    document.setIn(path, node);
  }
  return asWritten(document);
}

const asWritten = (document: Document): string =>
  document.toString({ lineWidth: 0, flowCollectionPadding: false });

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
    return asWritten(changed);
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
