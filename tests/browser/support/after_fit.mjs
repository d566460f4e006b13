// What a calibration would leave of a sensor's error: the rest of an affine fit of readings to truth.
//
//   errorAfterFit(readings, truths)   arrays of six numbers each; fitted on the first half, the RMS error per axis on the second
//   matchPictures(times_s, readings, truthAt, count, rate)
//       which picture of a looping clip of `count` pictures each reading is of: {pictures, truths}. A busy machine's camera falls
//       behind its own clock, so time alone does not tell: it is the way through the clip that agrees best with the readings
//       (neighbours in motion are a hundred times farther apart than what the tracker leaves).
const kColumns = 7;

/** Least squares with an offset by normal equations: x of A x = b for each column of b, A's rows being [reading, 1]. */
function affine(readings, truths) {
  const scale = Array.from({ length: 6 }, (_, i) => Math.max(...readings.map((r) => Math.abs(r[i])), 1e-12));
  const row = (r) => [...r.map((value, i) => value / scale[i]), 1];
  const normal = Array.from({ length: kColumns }, () => new Array(kColumns + 6).fill(0));
  readings.forEach((reading, k) => {
    const a = row(reading);
    for (let i = 0; i < kColumns; i++) {
      for (let j = 0; j < kColumns; j++) normal[i][j] += a[i] * a[j];
      for (let j = 0; j < 6; j++) normal[i][kColumns + j] += a[i] * truths[k][j];
    }
  });
  for (let i = 0; i < kColumns; i++) {
    let pivot = i;
    for (let k = i + 1; k < kColumns; k++) if (Math.abs(normal[k][i]) > Math.abs(normal[pivot][i])) pivot = k;
    [normal[i], normal[pivot]] = [normal[pivot], normal[i]];
    for (let k = 0; k < kColumns; k++) {
      if (k === i) continue;
      const factor = normal[k][i] / normal[i][i];
      for (let j = i; j < kColumns + 6; j++) normal[k][j] -= factor * normal[i][j];
    }
  }
  const map = normal.map((line, i) => line.slice(kColumns).map((value) => value / line[i]));
  return (reading) => {
    const a = row(reading);
    return Array.from({ length: 6 }, (_, j) => a.reduce((sum, value, i) => sum + value * map[i][j], 0));
  };
}

export function errorAfterFit(readings, truths) {
  const half = readings.length >> 1;
  const map = affine(readings.slice(0, half), truths.slice(0, half));
  const squares = new Array(6).fill(0);
  readings.slice(half).forEach((reading, k) => {
    map(reading).forEach((value, i) => (squares[i] += (value - truths[half + k][i]) ** 2));
  });
  return squares.map((sum) => Math.sqrt(sum / (readings.length - half)));
}

/** Several times the tracker's noise, m and rad. */
const kNoise = [1e-6, 1e-6, 3e-6, 3e-4, 3e-4, 3e-4];
const distance = (a, b) => a.reduce((sum, value, i) => sum + ((value - b[i]) / kNoise[i]) ** 2, 0);

const kLate = 12; // pictures that a busy camera may come later than by its clock, from one to the next
const kHaste = 0.05; // of distance(), for each picture off the clock, squared: decides only where pictures are alike

/** The way through the clip, round and round, that agrees best with what was read (Viterbi). */
function follow(readings, steps, truthAt, count) {
  const wrap = (index) => ((index % count) + count) % count;
  let costs = Array.from({ length: count }, (_, i) => distance(readings[0], truthAt(i)));
  const from = [[]];
  for (let k = 1; k < readings.length; k++) {
    const expected = steps[k] - steps[k - 1];
    const next = new Array(count).fill(Infinity);
    from.push(new Array(count).fill(0));
    for (let i = 0; i < count; i++) {
      for (let step = Math.max(0, expected - kLate); step <= expected + kLate; step++) {
        const cost = costs[wrap(i - step)] + kHaste * (step - expected) ** 2;
        if (cost < next[i]) [next[i], from[k][i]] = [cost, wrap(i - step)];
      }
      next[i] += distance(readings[k], truthAt(i));
    }
    costs = next;
  }
  const pictures = [costs.indexOf(Math.min(...costs))];
  for (let k = readings.length - 1; k > 0; k--) pictures.unshift(from[k][pictures[0]]);
  return pictures;
}

export function matchPictures(times_s, readings, truthAt, count, rate) {
  const steps = times_s.map((t) => Math.round((t - times_s[0]) * rate));
  let pictures = follow(readings, steps, truthAt, count);
  for (let turn = 0; turn < 4; turn++)
    pictures = follow(readings.map(affine(readings, pictures.map(truthAt))), steps, truthAt, count);
  return { pictures, truths: pictures.map(truthAt) };
}
