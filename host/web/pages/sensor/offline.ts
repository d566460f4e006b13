// Works without a network once it was loaded: the browser keeps the built files (service_worker.ts).

/** `tell` hears once that the page is kept, or that a newer one is there. */
export async function keepOffline(tell: (state: 'kept' | 'newer') => void): Promise<void> {
  if (!('serviceWorker' in navigator) || !import.meta.env.PROD) return;
  const had = navigator.serviceWorker.controller !== null;
  try {
    const registration = await navigator.serviceWorker.register('./service_worker.js', { scope: './', updateViaCache: 'none' });
    if (had) {
      registration.addEventListener('updatefound', () => {
        registration.installing?.addEventListener('statechange', (event) => {
          if ((event.target as ServiceWorker).state === 'activated') tell('newer');
        });
      });
    }
    await navigator.serviceWorker.ready;
    tell('kept');
  } catch {
    // A private window, or storage is full: the page works, but only online.
  }
}
