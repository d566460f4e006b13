// wrench_report_test.js EXAMPLES GOLDEN.json: the page's decoder on the golden reports, and the page's own script as far as
// it can be read without a browser.
"use strict";
const assert = require("node:assert");
const fs = require("node:fs");
const path = require("node:path");
const vm = require("node:vm");

const [examples, golden] = process.argv.slice(2);
const { WRENCH, decodeWrench } = require(path.resolve(examples, "wrench_report.js"));
const reports = JSON.parse(fs.readFileSync(golden)).reports.map(({ what, bytes, sample }) => ({
  what, sample, bytes: Buffer.from(bytes.map(([, hex]) => hex).join(""), "hex"),
}));

function decode(bytes) {
  const body = Uint8Array.from(bytes.subarray(1));
  return decodeWrench(bytes[0], new DataView(body.buffer));
}

assert.ok(reports.length >= 3);
for (const { what, bytes, sample } of reports) {
  const got = decode(bytes);
  assert.ok(got, what);
  assert.deepStrictEqual(got.force_n, sample.force_n, what);
  assert.deepStrictEqual(got.torque_nm, sample.torque_nm, what);
  assert.deepStrictEqual(got.forceSigma_n, sample.force_sigma_n, what);
  assert.deepStrictEqual(got.torqueSigma_nm, sample.torque_sigma_nm, what);
  assert.ok(Math.abs(got.captureTime_s - sample.capture_time_ns / 1e9) < 1e-6, what);
  for (const key of ["sequence", "lost", "status"]) assert.strictEqual(got[key], sample[key], what);
  assert.strictEqual(got.hasNumbers, sample.has_numbers, what);
}

const good = reports[0].bytes;
assert.strictEqual(decode(good.subarray(0, 63)), null, "short");
assert.strictEqual(decode(Buffer.concat([good, Buffer.alloc(1)])), null, "long");
for (const [at, byte] of [[0, 1], [4, 0x80], [28, 0x80], [55, 0x10], [60, 0x80], [63, 5]]) {
  const bad = Buffer.from(good);
  if (at === 4) bad.fill(0, 1, 4); // -2^31, which the descriptor leaves out
  bad[at] = byte;
  assert.strictEqual(decode(bad), null, `byte ${at}`);
}
const doubtful = Buffer.from(good);
doubtful[63] = 3;
assert.deepStrictEqual(decode(doubtful).force_n, [0, 0, 0]);

// The page: its scripts parse, it loads nothing from elsewhere, and shows what it is given.
const page = fs.readFileSync(path.join(examples, "webhid.html"), "utf8");
assert.doesNotMatch(page, /(src|href)="(https?:)?\/\//);
const script = page.match(/<script>\n([^]*?)<\/script>/)[1];

function element() {
  return {
    style: {}, textContent: "", className: "", value: "5",
    insertRow: element, insertCell: element,
    appendChild(child) { child.parentElement = this; return child; },
  };
}
const elements = {};
const made = [];
let frame = null;
let handler = null;
let asked = null;
const device = { vendorId: WRENCH.vendorId, productId: WRENCH.productId, productName: "sensor", opened: false,
  async open() { this.opened = true; }, set oninputreport(f) { handler = f; } };
const tracked = () => { const e = element(); e.insertRow = e.insertCell = tracked; made.push(e); return e; };
const context = {
  WRENCH, decodeWrench, console,
  document: { getElementById: (id) => (elements[id] ??= tracked()), createElement: tracked },
  navigator: { hid: { getDevices: async () => [], requestDevice: async (options) => { asked = options; return [device]; } } },
  performance: { now: () => 1000 },
  requestAnimationFrame: (f) => { frame = f; },
};
vm.runInNewContext(script, context);

(async () => {
  await elements.connect.onclick();
  assert.strictEqual(asked.filters[0].vendorId, 0x1209);
  assert.ok(device.opened && handler);
  const body = Uint8Array.from(good.subarray(1));
  handler({ reportId: good[0], data: new DataView(body.buffer) });
  frame();
  const texts = made.map((e) => e.textContent);
  assert.ok(texts.includes("3.000 ± 0.030 N"), texts.join("|"));
  assert.ok(texts.includes("-0.00200 ± 0.00020 N m"), texts.join("|"));
  assert.match(elements.state.textContent, /ok, frame 41/);
  assert.ok(made.some((e) => e.style.width === "30%" && e.style.left === "50%"), "Fz: 3 N of 5 N, to the right");
  console.log(`${reports.length} golden reports and the page: ok`);
})();
