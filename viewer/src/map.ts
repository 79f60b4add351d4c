// The clips as dots of a plane: colour by label, search, a preview of what the pointer is over.
import { pointAt } from "./body.ts";
import type { ClipData } from "./data.ts";
import { byId, context2d, element, printable } from "./dom.ts";
import type { PageLibrary } from "./library.ts";
import { Theme } from "./theme.ts";

const near = 14; // pixels from a dot that count as on it
const previewLevel = 6;
const mostListed = 100;

export class MotionMap {
  private readonly canvas = byId<HTMLCanvasElement>("map-canvas");
  private readonly search = byId<HTMLInputElement>("search");
  private readonly colourBy = byId<HTMLSelectElement>("colour-by");
  private readonly found = byId("found");
  private readonly preview = byId("preview");
  private readonly previewCanvas = byId<HTMLCanvasElement>("preview-canvas");
  private chosenLabel: string | undefined;
  private legendLabels: string[] = [];
  private hovered: number | undefined;
  private hoveredSince = 0;
  private current = 0;
  private nearest = new Set<number>();
  private bounds = { x: 0, y: 0, scale: 1 };
  private frameAsked = false;

  constructor(
    private readonly library: PageLibrary,
    private readonly theme: Theme,
    private readonly play: (clip: number) => void,
  ) {
    this.offerColours();
    this.colourBy.addEventListener("change", () => this.relabel());
    this.search.addEventListener("input", () => this.listFound());
    this.search.addEventListener("keydown", (event) => {
      const first = this.matches().find((i) => library.plays(i));
      if (event.key === "Enter" && first !== undefined) {
        play(first);
        byId("canvas").focus(); // keys are for the player again
      }
      if (event.key === "Escape") this.find("");
    });
    this.canvas.addEventListener("pointermove", (event) => this.hover(this.dotAt(event)));
    this.canvas.addEventListener("pointerleave", () => this.hover(undefined));
    this.canvas.addEventListener("click", (event) => {
      const dot = this.dotAt(event);
      if (dot !== undefined && library.plays(dot)) play(dot);
    });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.relabel();
  }

  show(current: number, nearest: number[]): void {
    const space = this.clips[this.current]?.space;
    this.current = current;
    this.nearest = new Set(nearest);
    if (space !== this.clips[current]?.space) this.relabel();
    this.note();
    this.draw();
  }

  find(text: string): void {
    this.search.value = text;
    this.listFound();
  }

  draw(): void {
    if (this.frameAsked) return;
    this.frameAsked = true;
    requestAnimationFrame(() => {
      this.frameAsked = false;
      this.paint();
    });
  }

  // The preview moves while the pointer rests on a dot.
  animate(now: number): void {
    if (this.hovered === undefined || this.preview.hidden) return;
    this.paintPreview((now - this.hoveredSince) / 1000);
  }

  private get clips(): ClipData[] {
    return this.library.overview.clips;
  }

  private get shown(): number[] {
    const space = this.clips[this.current]?.space;
    return this.clips.flatMap((clip, i) => (clip.space === space ? [i] : []));
  }

  private offerColours(): void {
    const places = Math.min(4, Math.max(0, ...this.clips.map((clip) => clip.labels.length)));
    for (let k = 0; k < places; ++k) {
      const values = [...new Set(this.clips.map((clip) => clip.labels[k]).filter((label) => label !== undefined))];
      const example = printable(values.slice(0, 2).join(", "));
      const option = element("option", `label ${k + 1} (${example.length > 22 ? `${example.slice(0, 21)}…` : example}${values.length > 2 ? ", …" : ""})`);
      option.value = String(k);
      this.colourBy.append(option);
    }
    const none = element("option", places === 0 ? "one colour (no labels)" : "one colour");
    none.value = "";
    this.colourBy.append(none);
  }

  private labelOf(clip: ClipData): string | undefined {
    return this.colourBy.value === "" ? undefined : clip.labels[Number(this.colourBy.value)];
  }

  // Also when the page turned dark or light.
  relabel(): void {
    const counts = new Map<string, number>();
    for (const i of this.shown) {
      const label = this.labelOf(this.clips[i]!);
      if (label !== undefined) counts.set(label, (counts.get(label) ?? 0) + 1);
    }
    this.legendLabels = [...counts].sort((a, b) => b[1] - a[1] || (a[0] < b[0] ? -1 : 1)).map(([label]) => label);
    this.chosenLabel = undefined;
    this.fillLegend(counts);
    this.listFound();
  }

  private fillLegend(counts: Map<string, number>): void {
    const chips = this.legendLabels.slice(0, Theme.categories).map((label, k) => {
      const chip = element("button", "", "chip");
      chip.type = "button";
      chip.setAttribute("aria-pressed", "false");
      const dot = element("i");
      dot.style.background = this.theme.category(k);
      chip.append(dot, element("span", `${printable(label)} ${counts.get(label)}`));
      chip.addEventListener("click", () => {
        this.chosenLabel = this.chosenLabel === label ? undefined : label;
        for (const other of byId("legend").children) other.setAttribute("aria-pressed", String(other === chip && this.chosenLabel === label));
        this.listFound();
      });
      return chip;
    });
    byId("legend").replaceChildren(...chips);
    const others = this.legendLabels.length - Theme.categories;
    if (others > 0) byId("legend").append(element("span", `and ${others} more in grey`, "fine"));
  }

  private note(): void {
    const space = this.library.spaces[this.clips[this.current]?.space ?? 0];
    const shares = (space?.data.map_shares ?? [0, 0]).map((share) => `${(share * 100).toFixed(0)} %`);
    const spaces = this.library.spaces.length;
    byId("map-note").textContent =
      `Across and up: the two directions in which clips differ most, ${shares[0]} and ${shares[1]} of all their difference.` +
      (spaces > 1 ? ` One of ${spaces} spaces, that of the clip's skeleton.` : "");
  }

  private isFiltered(): boolean {
    return this.search.value.trim() !== "" || this.chosenLabel !== undefined;
  }

  private matches(): number[] {
    const words = this.search.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    return this.shown.filter((i) => {
      const clip = this.clips[i]!;
      if (this.chosenLabel !== undefined && this.labelOf(clip) !== this.chosenLabel) return false;
      const text = [clip.name, ...clip.labels].join(" ").toLowerCase();
      return words.every((word) => text.includes(word));
    });
  }

  private listFound(): void {
    const filtered = this.isFiltered();
    const matches = filtered ? this.matches() : [];
    this.found.hidden = matches.length === 0;
    this.found.replaceChildren(
      ...matches.slice(0, mostListed).map((i) => {
        const clip = this.clips[i]!;
        const button = element("button");
        button.type = "button";
        button.disabled = !this.library.plays(i);
        button.append(element("span", printable(clip.name)), element("span", button.disabled ? "not in this page" : `${((clip.frames - 1) / clip.rate).toFixed(1)} s`));
        button.addEventListener("click", () => this.play(i));
        const item = element("li");
        item.append(button);
        return item;
      }),
    );
    byId("found-note").textContent = !filtered ? "" : `${matches.length} of ${this.shown.length} clips${matches.length > mostListed ? `, the first ${mostListed} listed` : ""}`;
    this.draw();
  }

  private fit(width: number, height: number): void {
    let [lowX, highX, lowY, highY] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const i of this.shown) {
      const clip = this.clips[i]!;
      lowX = Math.min(lowX, clip.x);
      highX = Math.max(highX, clip.x);
      lowY = Math.min(lowY, clip.y);
      highY = Math.max(highY, clip.y);
    }
    const margin = 20;
    const scale = Math.min((width - 2 * margin) / Math.max(highX - lowX, 1e-6), (height - 2 * margin) / Math.max(highY - lowY, 1e-6));
    this.bounds = { x: width / 2 - (scale * (lowX + highX)) / 2, y: height / 2 + (scale * (lowY + highY)) / 2, scale };
  }

  private place(i: number): [number, number] {
    const clip = this.clips[i]!;
    const { x, y, scale } = this.bounds;
    return [x + scale * clip.x, y - scale * clip.y];
  }

  private dotAt(event: MouseEvent): number | undefined {
    const box = this.canvas.getBoundingClientRect();
    let best: number | undefined;
    let least = near * near;
    for (const i of this.isFiltered() ? this.matches() : this.shown) {
      const [x, y] = this.place(i);
      const squared = (x - event.clientX + box.left) ** 2 + (y - event.clientY + box.top) ** 2;
      if (squared < least) [least, best] = [squared, i];
    }
    return best;
  }

  private paint(): void {
    const { canvas } = this;
    if (canvas.clientWidth === 0) return;
    const context = context2d(canvas);
    this.fit(canvas.clientWidth, canvas.clientHeight);
    const shown = this.shown;
    const radius = shown.length > 2000 ? 2.2 : shown.length > 400 ? 3.2 : 4.6;
    const matching = new Set(this.isFiltered() ? this.matches() : shown);
    const rank = new Map(this.legendLabels.map((label, k) => [label, k]));
    const ordered = [...shown].sort((a, b) => Number(matching.has(a)) - Number(matching.has(b)));
    this.paintLinks(context);
    for (const i of ordered) {
      const clip = this.clips[i]!;
      const label = this.labelOf(clip);
      const [x, y] = this.place(i);
      context.globalAlpha = matching.has(i) ? 0.92 : 0.14;
      context.beginPath();
      context.arc(x, y, radius, 0, 2 * Math.PI);
      context.fillStyle = this.colourBy.value === "" ? this.theme.text("accent") : this.theme.category(label === undefined ? Theme.categories : rank.get(label)!);
      if (this.library.plays(i)) {
        context.fill();
        context.lineWidth = 1;
        context.strokeStyle = this.theme.text("paper");
        context.stroke();
      } else {
        context.lineWidth = 1.4;
        context.strokeStyle = context.fillStyle;
        context.stroke();
      }
    }
    context.globalAlpha = 1;
    for (const i of this.nearest) if (this.clips[i]!.space === this.clips[this.current]!.space) this.ring(context, i, radius + 2.5, 1.2, "muted");
    this.ring(context, this.current, radius + 4, 2.2, "ink");
    if (this.hovered !== undefined) this.ring(context, this.hovered, radius + 3, 1.6, "accent");
  }

  private paintLinks(context: CanvasRenderingContext2D): void {
    const [x, y] = this.place(this.current);
    context.strokeStyle = this.theme.text("muted");
    context.lineWidth = 0.8;
    context.globalAlpha = 0.6;
    for (const i of this.nearest) {
      if (this.clips[i]!.space !== this.clips[this.current]!.space) continue;
      const [a, b] = this.place(i);
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(a, b);
      context.stroke();
    }
  }

  private ring(context: CanvasRenderingContext2D, i: number, radius: number, line: number, colour: "ink" | "muted" | "accent"): void {
    const [x, y] = this.place(i);
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.lineWidth = line;
    context.strokeStyle = this.theme.text(colour);
    context.stroke();
  }

  private hover(dot: number | undefined): void {
    if (dot === this.hovered) return;
    this.hovered = dot;
    this.hoveredSince = performance.now();
    this.preview.hidden = dot === undefined;
    this.canvas.style.cursor = dot === undefined ? "crosshair" : "pointer";
    if (dot !== undefined) {
      const [x, y] = this.place(dot);
      const width = this.canvas.clientWidth;
      this.preview.style.left = `${Math.min(Math.max(0, x - 68), width - 136)}px`;
      this.preview.style.top = y > 175 ? `${y - 172}px` : `${y + 16}px`;
      const clip = this.clips[dot]!;
      byId("preview-name").textContent = printable(clip.name) + (this.library.plays(dot) ? "" : ", not in this page");
      this.previewCanvas.hidden = !this.library.plays(dot);
      this.paintPreview(0);
    }
    this.draw();
  }

  // Seen from the side of where it looks at first, a little turned.
  private paintPreview(elapsed: number): void {
    const played = this.hovered === undefined ? undefined : this.library.motion(this.hovered);
    if (!played) return;
    const context = context2d(this.previewCanvas);
    const frame = (elapsed * played.clip.rate) % Math.max(1, played.clip.frames - 1);
    const positions = played.positions(Math.min(previewLevel, played.motion.space.levels));
    const [cx, , cz] = played.target(frame);
    const scale = (this.previewCanvas.clientHeight * 0.8) / played.height;
    const turn = played.motion.data.heading + 0.9;
    const place = (point: number): [number, number] => {
      const [x, y, z] = pointAt(positions, played.points, frame, point);
      return [
        this.previewCanvas.clientWidth / 2 + scale * ((x - cx) * Math.cos(turn) - (z - cz) * Math.sin(turn)),
        this.previewCanvas.clientHeight * 0.94 - scale * (y - played.ground),
      ];
    };
    context.lineCap = "round";
    for (const bone of played.body.bones) {
      context.beginPath();
      context.strokeStyle = this.theme.text(bone.side);
      context.lineWidth = Math.max(1.2, bone.radius * scale * 1.7);
      context.moveTo(...place(bone.from));
      context.lineTo(...place(bone.to));
      context.stroke();
    }
    if (played.body.head) {
      const [a, b] = place(played.body.head.from);
      const [c, d] = place(played.body.head.to);
      context.beginPath();
      context.fillStyle = this.theme.text("body");
      context.arc((a + c) / 2, (b + d) / 2, played.body.head.radius * scale * 1.1, 0, 2 * Math.PI);
      context.fill();
    }
  }
}
