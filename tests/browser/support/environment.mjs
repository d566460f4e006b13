// Where things are, for every test of the pages. All of it can be said by environment variables:
//   TAGWRENCH_PROGRAM      the native program          (default build/host/tagwrench)
//   TAGWRENCH_WEB_BUILD    folder of the built pages   (default build/web: dashboard/ sensor/ flip/ core/)
//   TAGWRENCH_CHROMIUM     the browser                 (default the first of /usr/bin/chromium, chromium-browser, google-chrome)
//   TAGWRENCH_SCREENSHOTS  where pictures of the views go (default build/tests/browser)
//   TAGWRENCH_DATA         recorded data of the real sensor; tests that need it are skipped without
//
//   program, webBuild, data     the paths, whether there or not (data: undefined if not set)
//   reason(...needs)            why a test must be skipped ('chromium', 'program', 'sensor', 'dashboard', 'flip', 'core',
//                               'data', 'packages'), or false: test(name, { skip: reason('chromium', 'sensor') }, ...)
//   scratch(name)               a new folder for this test run, deleted when the process ends
//   nodePackage(name)           a package of host/web/pages (playwright-core, yaml, ...)
import { existsSync, mkdirSync, mkdtempSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

export const root = resolve(fileURLToPath(import.meta.url), '../../../..');
const setting = (name, otherwise) => resolve(process.env[name] || join(root, otherwise));

export const program = setting('TAGWRENCH_PROGRAM', 'build/host/tagwrench');
export const webBuild = setting('TAGWRENCH_WEB_BUILD', 'build/web');
export const data = process.env.TAGWRENCH_DATA || undefined;
export const pages = join(root, 'host/web/pages');
export const chromiumPath =
  process.env.TAGWRENCH_CHROMIUM ||
  ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'].find((path) => existsSync(path));

const require = createRequire(join(pages, 'package.json'));
export const nodePackage = (name) => require(name);

const kOldestNode = 18;
const lacks = {
  packages: () => false,
  chromium: () => !chromiumPath && 'chromium is not installed (apt install chromium)',
  program: () => !existsSync(program) && `the program is not built (${program})`,
  data: () => !data && 'TAGWRENCH_DATA is not set: no recorded picture of the real sensor',
};
for (const page of ['sensor', 'dashboard', 'flip'])
  lacks[page] = () => !existsSync(join(webBuild, page, 'index.html')) && `page ${page} is not built (in ${webBuild})`;
lacks.core = () => !existsSync(join(webBuild, 'core/core.mjs')) && `the WebAssembly core is not built (in ${webBuild})`;

/** The first thing that is missing, in words; false if nothing is. */
export function reason(...needs) {
  const node = Number(process.versions.node.split('.')[0]);
  if (node < kOldestNode) return `node ${kOldestNode} or newer runs these tests, this is ${process.versions.node}`;
  const packages = needs.includes('chromium') || needs.includes('packages');
  if (packages && !existsSync(join(pages, 'node_modules/playwright-core')))
    return 'the pages\' node packages are not fetched (`./run web` does)';
  for (const need of needs) {
    const words = lacks[need]();
    if (words) return words;
  }
  return false;
}

const scratchFolders = [];
process.on('exit', () => scratchFolders.forEach((folder) => rmSync(folder, { recursive: true, force: true })));

export function scratch(name) {
  const folder = mkdtempSync(join(tmpdir(), `tagwrench-${name}-`));
  scratchFolders.push(folder);
  return folder;
}

/** A new file's path in the folder of screenshots. */
export function screenshotPath(name) {
  const folder = setting('TAGWRENCH_SCREENSHOTS', 'build/tests/browser');
  mkdirSync(folder, { recursive: true });
  return join(folder, `${name}.png`);
}
