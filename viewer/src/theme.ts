// The colours of the page, light or dark, for what is drawn on canvases.
import type { Colour } from "./renderer.ts";

const names = ["scene", "grid", "shadow", "body", "left", "right", "ghost", "ink", "muted", "line", "paper", "accent", "surface"] as const;
export type ColourName = (typeof names)[number];

export const darkness = window.matchMedia("(prefers-color-scheme: dark)");

// Seven that can be told apart by the colour-blind too (Okabe and Ito 2008, without black and yellow); others are grey.
const categories = {
  light: ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b98300", "#56b4e9", "#6b4fa0"],
  dark: ["#4aa3df", "#f07f3c", "#2fc39a", "#e39ac2", "#e6b422", "#8fd0f5", "#a78be0"],
};

export class Theme {
  private css: Record<string, string> = {};

  constructor() {
    this.read();
    darkness.addEventListener("change", () => this.read());
  }

  text(name: ColourName): string {
    return this.css[name] ?? "#888";
  }

  colour(name: ColourName, alpha = 1): Colour {
    return rgb(this.text(name), alpha);
  }

  category(index: number): string {
    return categories[darkness.matches ? "dark" : "light"][index] ?? (darkness.matches ? "#6f747d" : "#9a9892");
  }

  static readonly categories = categories.light.length;

  private read(): void {
    const style = getComputedStyle(document.documentElement);
    for (const name of names) this.css[name] = style.getPropertyValue(`--${name}`).trim();
  }
}

export function rgb(hex: string, alpha = 1): Colour {
  const long = hex.length === 4 ? hex.replace(/[^#]/g, "$&$&") : hex;
  return [1, 3, 5].map((i) => parseInt(long.slice(i, i + 2), 16) / 255).concat(alpha) as Colour;
}
