// The core of the tab in node: the same TypeScript and the same WebAssembly, without a browser.
//
//   const { Core, loadFinder } = await coreModules();
//   const core = await loadCore();            with its finder, if { finder: true }
//   run(['sequence', ...], folder)            the program's side (tests/unit/web/core_vectors.cpp), run there: {status, stdout, stderr}
//   readVectors(folder)                       what it wrote: {...vectors.json, frame(i)}
import { spawnSync } from 'node:child_process';
import { closeSync, copyFileSync, existsSync, openSync, readFileSync, readSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { nodePackage, pages, reason, scratch, webBuild } from './environment.mjs';

const vectors = join(webBuild, 'core/core_vectors');

/** False if all is there, or what is missing. */
export const coreReason = (...needs) =>
  reason('core', 'packages', ...needs) || (!existsSync(vectors) && `the program's side of the comparison is not built (${vectors})`);

const kExports = "export * from './sensor/core'; export { loadFinder } from './sensor/finder';";

const fromBuild = (wasmUrl) => ({
  name: 'the built core',
  setup(build) {
    build.onResolve({ filter: /^@core\/.*\?url$/ }, ({ path }) => ({ path, namespace: 'url' }));
    build.onLoad({ filter: /.*/, namespace: 'url' }, () => ({ contents: `export default '${wasmUrl}'` }));
    build.onResolve({ filter: /^@core\/core\.mjs$/ }, () => ({ path: join(webBuild, 'core/core.mjs') }));
  },
});

let modules;
export function coreModules() {
  modules ??= (async () => {
    const outfile = join(scratch('core'), 'core.mjs');
    await nodePackage('esbuild').build({
      stdin: { contents: kExports, resolveDir: pages, loader: 'ts' },
      bundle: true, format: 'esm', platform: 'node', target: 'es2022', outfile, plugins: [fromBuild('')], logLevel: 'error',
      // OpenCV.js takes node for an older kind of node.
      banner: { js: "import { createRequire as requireOf } from 'node:module'; const require = requireOf(import.meta.url); const __dirname = '/';" },
    });
    return import(pathToFileURL(outfile));
  })();
  return modules;
}

export async function loadCore({ finder = false } = {}) {
  const { Core, loadFinder } = await coreModules();
  const core = await Core.load(readFileSync(join(webBuild, 'core/core.wasm')));
  if (finder) core.setFinder(await loadFinder());
  return core;
}

/** The same for a page that serves `folder`: page.js and what it loads, and a plain index.html. */
export async function bundleForPage(folder) {
  await nodePackage('esbuild').build({
    stdin: { contents: kExports, resolveDir: pages, loader: 'ts', sourcefile: 'page.ts' },
    bundle: true, format: 'esm', platform: 'browser', target: 'es2022', external: ['fs', 'path', 'crypto'], logLevel: 'error',
    outfile: join(folder, 'page.js'), plugins: [fromBuild('./core.wasm')],
  });
  copyFileSync(join(webBuild, 'core/core.wasm'), join(folder, 'core.wasm'));
  writeFileSync(join(folder, 'index.html'), '<!doctype html><meta charset="utf-8"><title>core</title><link rel="icon" href="data:,">');
}

export function run(words, cwd = undefined) {
  return spawnSync(vectors, words, { encoding: 'utf8', maxBuffer: 1e8, cwd });
}

export function readVectors(folder) {
  const all = JSON.parse(readFileSync(join(folder, 'vectors.json'), 'utf8'));
  const file = openSync(join(folder, 'frames.luma'), 'r');
  const bytes = all.width * all.height;
  const picture = new Uint8Array(bytes);
  return {
    ...all,
    /** Overwritten by the next call. */
    frame(i) {
      readSync(file, picture, 0, bytes, i * bytes);
      return picture;
    },
    close: () => closeSync(file),
  };
}
