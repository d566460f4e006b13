// The plainest of static hosts, for the tests of the built pages.
//
//   const host = await serveFolder(folder, { path: '/some/sub/path', headers: {...}, port: 0 });
//   host.url        'http://localhost:PORT/some/sub/path/' (a secure context)
//   host.port, host.requests   every path that was asked for, in order
//   await host.close()
//
// Right MIME types (a browser runs no module with a wrong one), no caching, GET and HEAD alone, nothing outside the folder.
import { createReadStream, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, normalize, resolve, sep } from 'node:path';

const kTypes = {
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.mjs': 'text/javascript; charset=utf-8',
  '.css': 'text/css; charset=utf-8',
  '.wasm': 'application/wasm',
  '.json': 'application/json; charset=utf-8',
  '.webmanifest': 'application/manifest+json; charset=utf-8',
  '.svg': 'image/svg+xml',
  '.png': 'image/png',
  '.yaml': 'text/plain; charset=utf-8',
};

function fileOf(folder, path, under) {
  if (!path.startsWith(under)) return undefined;
  const file = resolve(join(folder, normalize(decodeURIComponent(path.slice(under.length)))));
  if (file !== folder && !file.startsWith(folder + sep)) return undefined;
  const found = statSync(file, { throwIfNoEntry: false });
  if (found?.isFile()) return file;
  const index = join(file, 'index.html');
  return found?.isDirectory() && path.endsWith('/') && statSync(index, { throwIfNoEntry: false }) ? index : undefined;
}

export async function serveFolder(folder, { path = '', headers = {}, port = 0 } = {}) {
  const base = resolve(folder);
  const under = `${path}/`;
  const requests = [];
  const server = createServer((request, response) => {
    const asked = new URL(request.url, 'http://localhost').pathname;
    requests.push(asked);
    const file = request.method === 'GET' || request.method === 'HEAD' ? fileOf(base, asked, under) : undefined;
    if (!file) {
      response.writeHead(404, { 'Content-Type': 'text/plain' }).end('not found\n');
      return;
    }
    response.writeHead(200, {
      'Content-Type': kTypes[extname(file)] ?? 'application/octet-stream',
      'Content-Length': statSync(file).size,
      'Cache-Control': 'no-cache',
      ...headers,
    });
    if (request.method === 'HEAD') response.end();
    else createReadStream(file).pipe(response);
  });
  await new Promise((done, failed) => server.once('error', failed).listen(port, done));
  const used = server.address().port;
  return {
    url: `http://localhost:${used}${under}`,
    port: used,
    requests,
    close: () =>
      new Promise((done) => {
        server.close(done);
        server.closeAllConnections();
      }),
  };
}
