// One folder of pages a build: `vite build --mode dashboard`, `sensor` or `flip`. Each result is a folder that any static host serves
// from any path. The build (host/web/CMakeLists.txt) says where the tracker's WebAssembly is and where results go.
import { createHash } from 'node:crypto';
import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join, relative, resolve } from 'node:path';
import { type Plugin, defineConfig, transformWithEsbuild } from 'vite';

const built = process.env.TAGWRENCH_WEB_BUILD ?? resolve(import.meta.dirname ?? '.', '../../../build/web');

/** The pages' service worker, which keeps all that was built: the list and the hash of it are known last. */
function offline(root: string, outDir: string): Plugin {
  const source = join(root, 'service_worker.ts');
  return {
    name: 'tagwrench-offline',
    apply: 'build',
    async closeBundle() {
      const names = readdirSync(outDir, { recursive: true, withFileTypes: true })
        .filter((entry) => entry.isFile())
        .map((entry) => relative(outDir, join(entry.parentPath ?? entry.path, entry.name)).replaceAll('\\', '/'))
        .filter((name) => name !== 'service_worker.js')
        .sort();
      const hash = createHash('sha256');
      for (const name of names) hash.update(name).update(readFileSync(join(outDir, name)));
      const define = {
        KEPT_FILES: JSON.stringify(['./', ...names.map((name) => `./${name}`)]),
        KEPT_VERSION: JSON.stringify(hash.digest('hex').slice(0, 16)),
      };
      const { code } = await transformWithEsbuild(readFileSync(source, 'utf8'), source, { define, minify: true, sourcemap: false });
      writeFileSync(join(outDir, 'service_worker.js'), code);
    },
  };
}

export default defineConfig(({ mode }) => ({
  root: resolve(import.meta.dirname ?? '.', mode),
  base: './',
  publicDir: 'public',
  resolve: { alias: { '@core': resolve(built, 'core') } },
  worker: { format: 'es' },
  plugins: mode === 'sensor' ? [offline(resolve(import.meta.dirname ?? '.', mode), resolve(built, mode))] : [],
  build: {
    outDir: resolve(built, mode),
    emptyOutDir: true,
    target: 'es2022',
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 700,
    modulePreload: { polyfill: false },
  },
}));
