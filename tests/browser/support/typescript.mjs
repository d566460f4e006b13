// A TypeScript module of the pages, for tests that need no browser: const { crc16 } = await loadModule('sensor/extras/board_frame.ts').
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { nodePackage, pages, scratch } from './environment.mjs';

export async function loadModule(path) {
  const outfile = join(scratch('module'), 'module.mjs');
  await nodePackage('esbuild').build({
    entryPoints: [join(pages, path)], outfile, bundle: true, format: 'esm', platform: 'neutral', target: 'es2022',
    loader: { '.css': 'empty' }, logLevel: 'silent',
  });
  return import(pathToFileURL(outfile));
}
