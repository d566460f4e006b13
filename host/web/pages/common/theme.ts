// Light or dark: as the system has it, or as the switch says; and colours of theme.css for canvases.
import { button, make } from './elements';

export type Theme = 'system' | 'light' | 'dark';

const KEY = 'tagwrench.theme';
const WORDS: Readonly<Record<Theme, string>> = { system: 'Auto', light: 'Light', dark: 'Dark' };
const ORDER: readonly Theme[] = ['system', 'light', 'dark'];

const listeners = new Set<() => void>();
const systemDark = matchMedia('(prefers-color-scheme: dark)');
systemDark.addEventListener('change', tell);

function tell(): void {
  for (const listener of listeners) listener();
}

/** Storage may be forbidden; then a choice lasts as long as the page. */
function stored(): Theme {
  try {
    const said = localStorage.getItem(KEY);
    return ORDER.find((theme) => theme === said) ?? 'system';
  } catch {
    return 'system';
  }
}

export function setTheme(theme: Theme): void {
  if (theme === 'system') delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = theme;
  try {
    localStorage.setItem(KEY, theme);
  } catch {
    // The choice is not kept, which is all.
  }
  tell();
}

/** Called now and whenever colours have changed. */
export function onTheme(listener: () => void): void {
  listeners.add(listener);
  listener();
}

/** What a variable of theme.css is just now, as a colour that a canvas understands. */
export function colour(name: string): string {
  const probe = document.createElement('span');
  probe.style.color = `var(${name})`;
  probe.style.display = 'none';
  document.body.append(probe);
  const value = getComputedStyle(probe).color;
  probe.remove();
  return value;
}

/** The same colour, let through. */
export function translucent(rgb: string, alpha: number): string {
  const parts = rgb.match(/[\d.]+/g);
  return parts && parts.length >= 3 ? `rgba(${parts.slice(0, 3).join(', ')}, ${alpha})` : rgb;
}

/** A button that goes from automatic to light to dark. Puts the stored choice in force. */
export function themeSwitch(): HTMLButtonElement {
  let theme = stored();
  const element = button(
    '',
    () => {
      theme = ORDER[(ORDER.indexOf(theme) + 1) % ORDER.length] ?? 'system';
      show();
    },
    { class: 'quiet theme-switch' },
  );
  const show = (): void => {
    element.replaceChildren('\u25d0', make('span', {}, ` ${WORDS[theme]}`));
    element.setAttribute('aria-label', `Colours: ${WORDS[theme]}. Press to change`);
    element.title = 'Colours: automatic, light or dark';
    setTheme(theme);
  };
  show();
  return element;
}
