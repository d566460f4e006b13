// Small helpers to make and fill elements. Data only ever becomes text.

type Attributes = Readonly<Record<string, string | number | boolean>>;

/** `true` sets an attribute without a value, `false` leaves it out. */
export function make<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  attributes: Attributes = {},
  ...children: readonly (Node | string)[]
): HTMLElementTagNameMap[Tag] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== false) element.setAttribute(name, value === true ? '' : String(value));
  }
  element.append(...children);
  return element;
}

export function button(text: string, onPress: () => void, attributes: Attributes = {}): HTMLButtonElement {
  const element = make('button', { type: 'button', ...attributes }, text);
  element.addEventListener('click', onPress);
  return element;
}

/** Only what differs is written: no needless layout, and screen readers hear changes alone. */
export function say(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function present(element: HTMLElement | SVGElement, on: boolean): void {
  if (element.hasAttribute('hidden') === on) element.toggleAttribute('hidden', !on);
}

/** A panel with a heading. */
export function panel(title: string, className = '', ...children: readonly (Node | string)[]): HTMLElement {
  return make(
    'section',
    { class: `panel ${className}`.trim(), 'aria-label': title },
    make('h2', {}, title),
    ...children,
  );
}

let labels = 0;

/** A label and what it labels, in one row. */
export function field(label: string, control: HTMLElement, hint = ''): HTMLElement {
  if (!control.id) control.id = `field-${++labels}`;
  const row = make('div', { class: 'field' }, make('label', { for: control.id }, label), control);
  if (hint) {
    const note = make('span', { class: 'hint', id: `${control.id}-hint` }, hint);
    control.setAttribute('aria-describedby', note.id);
    row.append(note);
  }
  return row;
}

const SVG = 'http://www.w3.org/2000/svg';

export function drawing<Tag extends keyof SVGElementTagNameMap>(
  tag: Tag,
  attributes: Attributes = {},
  ...children: readonly (Node | string)[]
): SVGElementTagNameMap[Tag] {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}
