// Elements made by hand. Text goes in through textContent only; there is no innerHTML anywhere in the page.

type Child = Node | string | null | undefined | false;
type Attributes = Record<string, string | number | boolean | null | undefined>;

function fill<E extends Element>(element: E, attributes: Attributes, children: Child[]): E {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    element.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) if (child) element.append(child);
  return element;
}

export function el<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]) {
  return fill(document.createElement(tag), attributes, children);
}

export function svg(tag: string, attributes: Attributes = {}, ...children: Child[]): SVGElement {
  return fill(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
}

/** A button; `hint` is its accessible name and tooltip where its content is a picture. */
export function button(content: Child, hint: string | null, onClick: () => void, kind = "button"): HTMLButtonElement {
  const element = el("button", { type: "button", class: kind, "aria-label": hint, title: hint }, content);
  element.addEventListener("click", onClick);
  return element;
}

/** Sets the text where it differs: texts follow the time many times a second. */
export function setText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

const ICONS: Record<string, string[]> = {
  play: ["M7 4.5v15l12-7.5z"],
  pause: ["M6.5 5h4v14h-4z", "M13.5 5h4v14h-4z"],
  next: ["M5 5v14l9-7z", "M16 5h3v14h-3z"],
  previous: ["M19 5v14l-9-7z", "M5 5h3v14h-3z"],
  repeat: ["M4 11a7 7 0 0 1 12-4.6V4l5 4.2-5 4.2V9.5A4.6 4.6 0 0 0 6.6 11z", "M20 13a7 7 0 0 1-12 4.6V20l-5-4.2 5-4.2v2.9A4.6 4.6 0 0 0 17.4 13z"],
  sun: ["M12 7a5 5 0 1 0 0 10 5 5 0 0 0 0-10z", "M11 1h2v4h-2zM11 19h2v4h-2zM1 11h4v2H1zM19 11h4v2h-4zM4 5.4 5.4 4l2.8 2.8-1.4 1.4zM15.8 17.2l1.4-1.4L20 18.6 18.6 20zM4 18.6l2.8-2.8 1.4 1.4L5.4 20zM15.8 6.8 18.6 4 20 5.4l-2.8 2.8z"],
  download: ["M11 3h2v9l3.3-3.3 1.4 1.4L12 15.8l-5.7-5.7 1.4-1.4L11 12z", "M4 17h2v2h12v-2h2v4H4z"],
  layers: ["M12 3 2.5 8 12 13l9.5-5z", "m4.6 11-2.1 1.1L12 17l9.5-4.9-2.1-1.1L12 14.9z"],
  frame: ["M3 3h6v2H5v4H3zM15 3h6v6h-2V5h-4zM3 15h2v4h4v2H3zM19 15h2v6h-6v-2h4z", "M9 9h6v6H9z"],
  check: ["M9.5 17.6 4 12.1l1.6-1.6 3.9 3.9 8.9-8.9L20 7.1z"],
  cross: ["M6.4 5 12 10.6 17.6 5 19 6.4 13.4 12l5.6 5.6-1.4 1.4-5.6-5.6L6.4 19 5 17.6l5.6-5.6L5 6.4z"],
};

export function icon(name: keyof typeof ICONS): SVGElement {
  return svg(
    "svg",
    { viewBox: "0 0 24 24", width: 18, height: 18, "aria-hidden": "true", class: "icon", fill: "currentColor" },
    ...ICONS[name].map((d) => svg("path", { d })),
  );
}
