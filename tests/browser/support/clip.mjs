// Pictures of the simulated sensor as a camera's clip.
//
//   simulate({ scenario: 'tests/sim/scenarios/default.yaml' or YAML text, frames, folder })
//       `tagwrench sim`: folder with 000000.png..., frames.csv, truth.csv, sensor.yaml; returns the folder
//   writeClip(folder, file, { rate: 25, range: 'full' | 'limited' })
//       the folder's pictures as Y4M for openChromium({clip}). 'full': Y is the grey level, bit for bit what a page reads
//       from the Y plane; 'limited': Y = 16 + 219/255 of it, what a page must have to see true grey on a canvas.
//   writePictures(pictures, file, options)   the same of {width, height, pixels} from anywhere
//   readGrey(file)  an 8-bit grey PNG (as `tagwrench sim` writes them): {width, height, pixels}
//   readTable(file) a CSV file with a heading: array of {column: number or text}
import { execFileSync } from 'node:child_process';
import { closeSync, existsSync, mkdirSync, openSync, readFileSync, writeFileSync, writeSync } from 'node:fs';
import { join } from 'node:path';
import { inflateSync } from 'node:zlib';
import { program, root, scratch } from './environment.mjs';

export function simulate({ scenario, frames, folder = scratch('sim') }) {
  mkdirSync(folder, { recursive: true });
  const argumentsOf = ['sim', '--out', join(folder, 'frames'), '--frames', String(frames)];
  if (scenario) {
    let file = join(root, scenario);
    if (scenario.includes('\n') || !existsSync(file)) {
      file = join(folder, 'scenario.yaml');
      writeFileSync(file, scenario);
    }
    argumentsOf.push('--scenario', file);
  }
  execFileSync(program, argumentsOf, { stdio: ['ignore', 'ignore', 'pipe'] });
  return join(folder, 'frames');
}

function paeth(left, up, corner) {
  const toLeft = Math.abs(up - corner);
  const toUp = Math.abs(left - corner);
  const toCorner = Math.abs(left + up - 2 * corner);
  if (toLeft <= toUp && toLeft <= toCorner) return left;
  return toUp <= toCorner ? up : corner;
}

/** Undoes PNG's five filters (RFC 2083, section 6) on rows of one byte a pixel. */
function unfilter(rows, width, height) {
  const pixels = new Uint8Array(width * height);
  for (let y = 0; y < height; y++) {
    const kind = rows[y * (width + 1)];
    const from = y * (width + 1) + 1;
    const to = y * width;
    for (let x = 0; x < width; x++) {
      const left = x > 0 ? pixels[to + x - 1] : 0;
      const up = y > 0 ? pixels[to + x - width] : 0;
      let guess = 0;
      if (kind === 1) guess = left;
      else if (kind === 2) guess = up;
      else if (kind === 3) guess = (left + up) >> 1;
      else if (kind === 4) guess = paeth(left, up, x > 0 && y > 0 ? pixels[to + x - width - 1] : 0);
      pixels[to + x] = rows[from + x] + guess;
    }
  }
  return pixels;
}

export function readGrey(file) {
  const bytes = readFileSync(file);
  let width = 0;
  let height = 0;
  const packed = [];
  for (let at = 8; at < bytes.length; ) {
    const length = bytes.readUInt32BE(at);
    const name = bytes.toString('latin1', at + 4, at + 8);
    const body = bytes.subarray(at + 8, at + 8 + length);
    if (name === 'IHDR') {
      width = body.readUInt32BE(0);
      height = body.readUInt32BE(4);
      if (body[8] !== 8 || body[9] !== 0 || body[12] !== 0) throw new Error(`${file}: not an 8-bit grey PNG`);
    }
    if (name === 'IDAT') packed.push(body);
    at += length + 12;
  }
  return { width, height, pixels: unfilter(inflateSync(Buffer.concat(packed)), width, height) };
}

export function writePictures(pictures, file, { rate = 25, range = 'full' } = {}) {
  const out = openSync(file, 'w');
  const level = Uint8Array.from({ length: 256 }, (_, g) => (range === 'full' ? g : Math.round(16 + (g * 219) / 255)));
  let first = true;
  for (const { width, height, pixels } of pictures) {
    if (first) writeSync(out, `YUV4MPEG2 W${width} H${height} F${rate}:1 Ip A1:1 C420jpeg\n`);
    first = false;
    const frame = Buffer.alloc(6 + (width * height * 3) / 2, 128);
    frame.write('FRAME\n', 'latin1');
    for (let y = 0; y < height; y++)
      for (let x = 0; x < width; x++)
        frame[6 + y * width + x] = level[pixels[y * width + x]];
    writeSync(out, frame);
  }
  closeSync(out);
  return file;
}

export function writeClip(folder, file, options = {}) {
  const names = readTable(join(folder, 'frames.csv')).map((row) => row.file);
  function* pictures() {
    for (const name of names) yield readGrey(join(folder, name));
  }
  return writePictures(pictures(), file, options);
}

export function readTable(file) {
  return parseTable(readFileSync(file, 'utf8'));
}

export function parseTable(text) {
  const [heading, ...rows] = text.trim().split('\n');
  const columns = heading.split(',');
  const value = (word) => (word !== '' && Number.isFinite(Number(word)) ? Number(word) : word);
  return rows.map((row) => Object.fromEntries(row.split(',').map((word, i) => [columns[i], value(word)])));
}
