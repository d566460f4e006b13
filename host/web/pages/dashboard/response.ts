// How far the device goes for a push: dead zone, curve, gain and limit, as the bridge works them out
// (host/wrench).
import type { AxisShape, CurveOf } from './profile_text';

/** Monotone cubic through points (Fritsch and Carlson; slopes after Fritsch and Butland), or a power. */
export function curveAt(curve: CurveOf, part: number): number {
  const x = Math.max(0, Math.min(1, part));
  const { points } = curve;
  if (!points) return x ** curve.power;
  const last = points.length - 1;
  const width = (i: number): number => (points[i + 1]?.[0] ?? 1) - (points[i]?.[0] ?? 0);
  const rise = (i: number): number => ((points[i + 1]?.[1] ?? 1) - (points[i]?.[1] ?? 0)) / width(i);
  let i = 0;
  while (i + 2 <= last && x > (points[i + 1]?.[0] ?? 1)) ++i;
  const t = (x - (points[i]?.[0] ?? 0)) / width(i);
  const u = 1 - t;
  const [from, to] = [points[i]?.[1] ?? 0, points[i + 1]?.[1] ?? 1];
  const [m0, m1] = [slopeAt(i, last, width, rise), slopeAt(i + 1, last, width, rise)];
  return u * u * (1 + 2 * t) * from + t * t * (3 - 2 * t) * to + t * u * width(i) * (u * m0 - t * m1);
}

function slopeAt(i: number, last: number, width: (i: number) => number, rise: (i: number) => number): number {
  if (last === 1) return rise(0);
  if (i === 0) return endSlope(width(0), rise(0), width(1), rise(1));
  if (i === last) return endSlope(width(last - 1), rise(last - 1), width(last - 2), rise(last - 2));
  const [d0, d1] = [rise(i - 1), rise(i)];
  if (d0 <= 0 || d1 <= 0) return 0;
  const [w0, w1] = [2 * width(i) + width(i - 1), width(i) + 2 * width(i - 1)];
  return (w0 + w1) / (w0 / d0 + w1 / d1);
}

function endSlope(h0: number, d0: number, h1: number, d1: number): number {
  return Math.max(0, Math.min(3 * d0, ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1)));
}

/**
 * Deflection, -1..1, of a push in N or N m that grows from rest; or, `back`, one that is let off after
 * twice the dead zone.
 */
export function deflection(shape: AxisShape, push: number, back = false): number {
  const size = Math.abs(push);
  const inner = shape.release * shape.dead;
  if (size <= (back ? inner : shape.dead)) return 0;
  const onward = shape.dead > 0 ? (size - shape.dead) / shape.dead : 1;
  const zero = back ? inner : Math.max(inner, shape.dead - (shape.dead - inner) * onward);
  const part = Math.min(1, (size - zero) / (shape.full - zero));
  return Math.sign(push) * Math.min(shape.limit, shape.gain * curveAt(shape.curve, part));
}
