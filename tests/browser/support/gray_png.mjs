// A grey picture with dark squares, as PNG: something to look at where no camera is.
import { crc32Of } from './crc32.mjs';
import { deflateSync } from 'node:zlib';

function chunk(name, data) {
  const body = Buffer.concat([Buffer.from(name), data]);
  const out = Buffer.alloc(body.length + 8);
  out.writeUInt32BE(data.length, 0);
  body.copy(out, 4);
  out.writeUInt32BE(crc32Of(body), body.length + 4);
  return out;
}

function inside(px, x, y) {
  let sign = 0;
  for (let i = 0; i < 8; i += 2) {
    const [x0, y0, x1, y1] = [px[i], px[i + 1], px[(i + 2) % 8], px[(i + 3) % 8]];
    const side = Math.sign((x1 - x0) * (y - y0) - (y1 - y0) * (x - x0));
    if (side !== 0 && sign !== 0 && side !== sign) return false;
    sign = side || sign;
  }
  return true;
}

/** tags: [{px: [x, y * 4]}], convex. */
export function grayPng(width, height, tags) {
  const rows = Buffer.alloc((width + 1) * height);
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const tag = tags.find(({ px }) => inside(px, x, y));
      const cell = ((x >> 5) * 7 + (y >> 5) * 3) % 5 < 2;
      rows[y * (width + 1) + 1 + x] = tag ? (cell ? 180 : 40) : 150 + 30 * Math.sin(x / 200);
    }
  }
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head.set([8, 0, 0, 0, 0], 8);
  const magic = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  return Buffer.concat([
    magic,
    chunk('IHDR', head),
    chunk('IDAT', deflateSync(rows)),
    chunk('IEND', Buffer.alloc(0)),
  ]);
}
