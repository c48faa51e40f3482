// Colours. Those of the page are defined once, in page.css; drawings read them from there.

/** Okabe and Ito's colours, then two more; finger i has colour i % 8 everywhere. */
export const PALETTE = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#999933", "#882255"];
export const fingerColour = (finger: number): string => (finger < 0 ? "#8a9299" : PALETTE[finger % PALETTE.length]);

/** Components of the roadmap (Tol's "bright"), the largest first; further ones are grey. */
export const COMPONENTS = ["#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377"];

export interface Colours {
  ink: string;
  muted: string;
  faint: string;
  line: string;
  panel: string;
  shade: string;
  stage: string;
  bad: string;
  accent: string;
  palm: string;
  objectLight: string;
  objectDark: string;
  objectMark: string;
}

export type Scheme = "light" | "dark";

export class Theme {
  scheme: Scheme;
  colours!: Colours;
  private readonly listeners: (() => void)[] = [];

  constructor() {
    const dark = matchMedia("(prefers-color-scheme: dark)");
    this.scheme = dark.matches ? "dark" : "light";
    dark.addEventListener("change", () => this.set(dark.matches ? "dark" : "light"));
    this.set(this.scheme);
  }

  toggle(): void {
    this.set(this.scheme === "dark" ? "light" : "dark");
  }

  onChange(listener: () => void): void {
    this.listeners.push(listener);
  }

  private set(scheme: Scheme): void {
    this.scheme = scheme;
    document.documentElement.dataset.theme = scheme;
    const style = getComputedStyle(document.documentElement);
    const read = (name: string) => style.getPropertyValue(`--${name}`).trim();
    this.colours = {
      ink: read("ink"),
      muted: read("muted"),
      faint: read("faint"),
      line: read("line"),
      panel: read("panel"),
      shade: read("shade"),
      stage: read("stage"),
      bad: read("bad"),
      accent: read("accent"),
      palm: read("palm"),
      objectLight: read("object-light"),
      objectDark: read("object-dark"),
      objectMark: read("object-mark"),
    };
    for (const listener of this.listeners) listener();
  }
}
