// `./run bench web`: the pages' figures, one table after the other. What this machine lacks is said and left out.
//
//   node tests/bench/web.mjs [PART...]     core, weight, dashboard, server; default all
import { spawnSync } from 'node:child_process';
import { existsSync, readdirSync, readFileSync, statSync } from 'node:fs';
import { dirname, extname, join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { openChromium, openPage } from '../browser/support/chromium.mjs';
import { program, reason, root, webBuild } from '../browser/support/environment.mjs';
import { serveFolder } from '../browser/support/static_server.mjs';

const kLoads = 5;

function child(title, command, args) {
  console.log(`\n${title}`);
  const { status, signal } = spawnSync(command, args, { stdio: 'inherit', env: { ...process.env, TAGWRENCH_WEB_BUILD: webBuild } });
  if (status === 77) console.log('left out: see the reason above');
  else if (status !== 0) process.exitCode = 1;
  return signal === null;
}

const files = (folder) =>
  readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    return entry.isDirectory() ? files(path) : [path];
  });
const kB = (bytes) => (bytes / 1000).toFixed(0).padStart(7);

/** What a page asks for until it is there, and for how long; medians of several loads by a browser that knows nothing yet. */
async function load(page) {
  const server = await serveFolder(join(webBuild, page));
  const times = [];
  let bytes = 0;
  for (let i = 0; i < kLoads; ++i) {
    const browser = await openChromium();
    try {
      const { page: tab } = await openPage(browser, server.url);
      const timing = await tab.evaluate(async () => {
        await document.fonts.ready;
        const [navigation] = performance.getEntriesByType('navigation');
        const all = [navigation, ...performance.getEntriesByType('resource')];
        return { loaded: navigation.loadEventEnd || performance.now(), bytes: all.reduce((sum, e) => sum + e.encodedBodySize, 0) };
      });
      times.push(timing.loaded);
      bytes = timing.bytes;
    } finally {
      await browser.close();
    }
  }
  await server.close();
  return { ms: times.sort((a, b) => a - b)[Math.floor(kLoads / 2)], bytes };
}

async function weight() {
  console.log('\nWeight of the pages, kB, and the time until a fresh browser on this computer has loaded them');
  console.log('page         in all     gzip   scripts   wasm   at first   loaded, ms');
  for (const page of ['dashboard', 'sensor', 'flip']) {
    const missing = reason('chromium', page);
    if (missing) {
      console.log(`${page.padEnd(10)} left out: ${missing}`);
      continue;
    }
    const all = files(join(webBuild, page)).map((path) => ({ path, size: statSync(path).size }));
    const sum = (kind) => all.filter(({ path }) => !kind || extname(path) === kind).reduce((total, { size }) => total + size, 0);
    const zipped = all.reduce((total, { path }) => total + gzipSync(readFileSync(path)).length, 0);
    const { ms, bytes } = await load(page);
    console.log(`${page.padEnd(10)} ${kB(sum())}  ${kB(zipped)}   ${kB(sum('.js'))} ${kB(sum('.wasm'))}    ${kB(bytes)}   ${ms.toFixed(0).padStart(10)}`);
  }
}

const here = (name) => join(root, 'tests', name);
const parts = {
  core: () => child('The tracker as WebAssembly, beside the program, on the same pictures', process.execPath, [here('bench/web_core.mjs')]),
  weight,
  dashboard: () => child('What the dashboard draws, with 20 s of six axes at 120 Hz', process.execPath, [here('browser/bench_dashboard.mjs'), '5']),
  server: () => {
    const bench = join(dirname(program), '../tests/bench/tagwrench_bench_web_server');
    if (!existsSync(bench)) console.log(`\nthe dashboard's cost to a frame is left out: ${bench} is not built`);
    else child("What a dashboard's reading costs the frame loop", bench, []);
  },
};

const wanted = process.argv.slice(2);
const unknown = wanted.find((name) => !(name in parts));
if (unknown) {
  console.error(`bench web: no such part '${unknown}'; it has: ${Object.keys(parts).join(', ')}`);
  process.exit(2);
}
for (const name of wanted.length ? wanted : Object.keys(parts)) await parts[name]();
