// Keeps the built files, all of them, under the name of their contents, and answers with them. The build (vite.config.ts) puts the
// list of files and their common hash in place of the two names below.
declare const KEPT_FILES: readonly string[];
declare const KEPT_VERSION: string;

const scope = self as unknown as ServiceWorkerGlobalScope;
const PREFIX = `tagwrench-${new URL(scope.registration.scope).pathname}-`;
const NAME = `${PREFIX}${KEPT_VERSION}`;

async function keep(): Promise<void> {
  const cache = await caches.open(NAME);
  await cache.addAll(KEPT_FILES.map((file) => new Request(file, { cache: 'no-cache' })));
  await scope.skipWaiting();
}

async function takeOver(): Promise<void> {
  const names = await caches.keys();
  await Promise.all(names.filter((name) => name.startsWith(PREFIX) && name !== NAME).map((name) => caches.delete(name)));
  await scope.clients.claim();
}

async function answer(request: Request): Promise<Response> {
  const cache = await caches.open(NAME);
  const kept = await cache.match(request, { ignoreSearch: true });
  return kept ?? fetch(request);
}

scope.addEventListener('install', (event) => event.waitUntil(keep()));
scope.addEventListener('activate', (event) => event.waitUntil(takeOver()));
scope.addEventListener('fetch', (event) => {
  const { request } = event;
  if (request.method === 'GET' && request.url.startsWith(scope.registration.scope)) event.respondWith(answer(request));
});
