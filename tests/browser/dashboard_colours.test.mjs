// Colours are readable in light and in dark, and the six axes can be told apart, by the colour-blind too.
// All from theme.css.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { pages } from './support/environment.mjs';

const kAxes = ['--axis-fx', '--axis-fy', '--axis-fz', '--axis-mx', '--axis-my', '--axis-mz'];
const kTexts = ['--ink', '--ink-soft', '--ink-faint', '--accent', '--good', '--warn', '--bad', ...kAxes];

/** Simulations of Machado, Oliveira and Fernandes 2009, severity 1, on linear RGB. */
const kBlindness = {
  protanopia: [
    [0.152286, 1.052583, -0.204868],
    [0.114503, 0.786281, 0.099216],
    [-0.003882, -0.048116, 1.051998],
  ],
  deuteranopia: [
    [0.367322, 0.860646, -0.227968],
    [0.280085, 0.672501, 0.047413],
    [-0.01182, 0.04294, 0.968881],
  ],
  tritanopia: [
    [1.255528, -0.076749, -0.178779],
    [-0.078411, 0.930809, 0.147602],
    [0.004733, 0.691367, 0.3039],
  ],
};

function themes() {
  const css = readFileSync(join(pages, 'common/theme.css'), 'utf8');
  const found = [...css.matchAll(/(--[a-z-]+): light-dark\((#[0-9a-f]{6}), (#[0-9a-f]{6})\)/g)];
  return [2, 3].map((side) => new Map(found.map((match) => [match[1], match[side]])));
}

function linear(hex) {
  return [1, 3, 5].map((at) => {
    const part = Number.parseInt(hex.slice(at, at + 2), 16) / 255;
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  });
}

const luminance = ([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

/** WCAG 2. */
function contrast(one, other) {
  const [low, high] = [luminance(linear(one)), luminance(linear(other))].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
}

/** CIE 1976 L*a*b*, D65. */
function lab([r, g, b]) {
  const xyz = [
    (0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505,
    0.2126 * r + 0.7152 * g + 0.0722 * b,
    (0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089,
  ].map((v) => (v > 0.008856 ? Math.cbrt(v) : 7.787 * v + 16 / 116));
  return [116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])];
}

function seenBy(matrix, colour) {
  return matrix.map((row) =>
    Math.max(0, Math.min(1, row[0] * colour[0] + row[1] * colour[1] + row[2] * colour[2])),
  );
}

for (const [index, theme] of themes().entries()) {
  const name = index === 0 ? 'light' : 'dark';

  test(`${name}: text has a contrast of at least 4.5 to every background it stands on`, () => {
    for (const text of kTexts) {
      for (const ground of ['--panel', '--well', '--page']) {
        if (kAxes.includes(text) && ground !== '--panel') continue;
        const found = contrast(theme.get(text), theme.get(ground));
        assert.ok(found >= 4.5, `${text} on ${ground}: ${found.toFixed(2)}`);
      }
    }
    assert.ok(contrast(theme.get('--on-accent'), theme.get('--accent')) >= 4.5, '--on-accent on --accent');
  });

  test(`${name}: lines of the axes have a contrast of at least 3 to the panel`, () => {
    for (const axis of kAxes) assert.ok(contrast(theme.get(axis), theme.get('--panel')) >= 3, axis);
  });

  test(`${name}: the three forces, and the three torques, differ by at least 10 in Lab, for the colour-blind too`, () => {
    const eyes = {
      usual: [
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
      ],
      ...kBlindness,
    };
    for (const [eye, matrix] of Object.entries(eyes)) {
      for (const group of [kAxes.slice(0, 3), kAxes.slice(3)]) {
        const seen = group.map((axis) => lab(seenBy(matrix, linear(theme.get(axis)))));
        for (const [i, j] of [
          [0, 1],
          [0, 2],
          [1, 2],
        ]) {
          const distance = Math.hypot(...seen[i].map((value, k) => value - seen[j][k]));
          assert.ok(distance >= 10, `${eye}: ${group[i]} and ${group[j]} differ by ${distance.toFixed(1)}`);
        }
      }
    }
  });
}
