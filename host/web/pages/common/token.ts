// The word that a bridge on a network asks for: it comes in the address' fragment, which no server sees, and
// is kept for this tab.

const KEY = 'tagwrench.token';

/**
 * Takes the token out of the address bar, so that it is neither shown, nor kept in history, nor passed on.
 */
export function takeToken(): string {
  const fragment = new URLSearchParams(location.hash.slice(1));
  const given = fragment.get('token');
  if (given !== null) {
    fragment.delete('token');
    const rest = fragment.size > 0 ? `#${[...fragment.keys()].join('&')}` : '';
    history.replaceState(null, '', `${location.pathname}${location.search}${rest}`);
    keep(given);
    return given;
  }
  try {
    return sessionStorage.getItem(KEY) ?? '';
  } catch {
    return '';
  }
}

function keep(token: string): void {
  try {
    sessionStorage.setItem(KEY, token);
  } catch {
    // It lasts until the page is left, then.
  }
}

/** The names that a connection asks for; the token is one of them, base64url without padding. */
export function subprotocols(token: string): string[] {
  if (token === '') return ['tagwrench.v1'];
  const bytes = new TextEncoder().encode(token);
  const encoded = btoa(String.fromCharCode(...bytes))
    .replaceAll('+', '-')
    .replaceAll('/', '_')
    .replaceAll('=', '');
  return ['tagwrench.v1', `tagwrench.token.${encoded}`];
}

/** A file of the bridge, asked for as the bridge wants to be asked. */
export async function fetchFile(path: string, token: string): Promise<Blob> {
  const headers: HeadersInit = token === '' ? {} : { Authorization: `Bearer ${token}` };
  const response = await fetch(path, { headers, cache: 'no-store' });
  if (!response.ok)
    throw new Error(`the bridge does not give ${path} (${response.status}); is it still there?`);
  return response.blob();
}
