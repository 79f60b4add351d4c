// The panels about a level of detail, the functions, and the nearest clips.
import { errorChart, functionChart, varianceChart, type Line } from "./charts.ts";
import { byId, centimetres, element, printable } from "./dom.ts";
import type { PageLibrary, PlayedClip } from "./library.ts";
import type { Theme } from "./theme.ts";

const mostCurves = 6;

// What was measured at the level, or at the nearest coarser one that was.
function measuredAt<T>(levels: T[], level: number, of: (entry: T) => number): T | undefined {
  return levels.filter((entry) => of(entry) <= level).at(-1);
}

export class FunctionPanel {
  private readonly slider = byId<HTMLInputElement>("lod");
  private readonly kind = byId<HTMLSelectElement>("kind");
  private clip: PlayedClip | undefined;
  private level = 1;

  constructor(
    private readonly library: PageLibrary,
    private readonly theme: Theme,
    setLevel: (level: number) => void,
  ) {
    this.slider.addEventListener("input", () => setLevel(Number(this.slider.value)));
    this.kind.addEventListener("change", () => this.draw());
  }

  show(clip: PlayedClip, level: number): void {
    const levels = clip.motion.space.levels;
    if (clip !== this.clip) this.offerKinds(clip);
    this.clip = clip;
    this.level = level;
    this.slider.max = String(levels);
    this.slider.value = String(level);
    this.slider.style.setProperty("--done", `${levels > 1 ? (100 * (level - 1)) / (levels - 1) : 100}%`);
    byId("lod-value").textContent = level >= levels ? `all ${levels} functions` : `${level} of ${levels} functions`;
    this.sayErrors(clip, level);
    this.draw();
  }

  private offerKinds(clip: PlayedClip): void {
    const names = (cycles: number) => (cycles === 0 ? "sequences cut at rests" : cycles === 1 ? "a whole cycle" : `${cycles} whole cycles`);
    const kinds = clip.motion.space.kinds();
    this.kind.replaceChildren(
      ...kinds.map((cycles) => {
        const option = element("option", names(cycles));
        option.value = String(cycles);
        return option;
      }),
    );
    this.kind.value = String(clip.motion.mostlyCycles());
  }

  private sayErrors(clip: PlayedClip, level: number): void {
    const own = measuredAt(clip.motion.data.levels, level, ([l]) => l);
    const all = measuredAt(this.library.overview.levels, level, (l) => l.functions);
    const say = (id: string, value: number | undefined) => (byId(id).textContent = value === undefined ? "–" : centimetres(value));
    say("lod-mean", own?.[1]);
    say("lod-max", own?.[2]);
    say("lod-library-mean", all?.mean_joint_error_cm);
    say("lod-library-max", all?.max_joint_error_cm);
    byId("lod-numbers").textContent = Math.round(clip.motion.numbersAt(level) / Math.max(clip.duration, 1e-9)).toLocaleString("en");
    const of = own?.[0] ?? all?.functions;
    const notes: string[] = [];
    if (of === undefined) notes.push("No errors were measured at this level when the library was built.");
    else if (of < level) notes.push(`Errors are those of ${of} functions, the nearest coarser level that was measured.`);
    if (of !== undefined) notes.push("Distances of joints from the clips as they were read.");
    if (clip.motion.data.feet && level < 10) notes.push("Feet are as the functions have them; kinespace export plants them at this level.");
    byId("lod-note").textContent = notes.join(" ");
  }

  private draw(): void {
    const { clip, level, theme } = this;
    if (!clip) return;
    const grey = theme.text("muted");
    const own = clip.motion.data.levels;
    const all = this.library.overview.levels;
    const lines: Line[] = [
      { name: "worst joint", colour: theme.text("right"), points: own.map(([l, , max]) => [l, max]) },
      { name: "mean", colour: theme.text("left"), points: own.map(([l, mean]) => [l, mean]) },
      { name: "", thin: true, colour: theme.text("right"), points: all.map((l) => [l.functions, l.max_joint_error_cm]) },
      { name: "", thin: true, colour: theme.text("left"), points: all.map((l) => [l.functions, l.mean_joint_error_cm]) },
    ];
    byId("error-chart").replaceChildren(errorChart(lines, clip.motion.space.levels, level));
    const set = clip.motion.space.set(Number(this.kind.value));
    const group = set.groups[0]!;
    const playing = Math.max(0, set.rowsAt(level) - set.ends);
    const count = Math.min(mostCurves, group.count);
    const curves = Array.from({ length: count }, (_, k) => group.functions.slice(k * set.points, (k + 1) * set.points));
    const colours = Array.from({ length: count }, (_, k) => theme.category(k));
    byId("function-chart").replaceChildren(functionChart(curves, playing, colours, grey));
    const groups = set.groups.length > 1 ? ` Those of the first of ${set.groups.length} groups of curves.` : "";
    byId("function-caption").textContent = `The first ${count} of ${group.count} functions over the time of a sequence; ${Math.min(playing, group.count)} play at this level.${groups}`;
    const shares = group.eigenvalues.map((value) => value / (group.variance || 1));
    byId("variance-chart").replaceChildren(varianceChart(shares, playing, theme.text("accent"), grey));
    byId("variance-caption").textContent = `Share of the curves' variance by function${set.pinned ? ", over what the ends of sequences leave" : ""}.`;
  }
}

export class NearestPanel {
  constructor(
    private readonly library: PageLibrary,
    private readonly play: (clip: number) => void,
  ) {}

  show(clip: PlayedClip): void {
    const nearest = clip.motion.data.nearest;
    const farthest = Math.max(1e-9, ...(nearest ?? []).map(([, distance]) => distance));
    byId("nearest").replaceChildren(...(nearest ?? []).map(([other, distance], i) => this.item(other, distance, distance / farthest, i + 1)));
    const beside = (nearest ?? []).filter(([other]) => this.library.plays(other)).length;
    byId<HTMLButtonElement>("compare").disabled = beside === 0;
    byId("nearest-note").textContent = !nearest
      ? "The nearest motions of this clip are not in the page."
      : nearest.length === 0
        ? "There is no other clip of this skeleton."
        : "As kinespace query orders them: by the cost of time warping. Side by side, clips are stretched to the same length.";
  }

  private item(other: number, distance: number, share: number, rank: number): HTMLLIElement {
    const clip = this.library.overview.clips[other]!;
    const button = element("button");
    button.type = "button";
    button.disabled = !this.library.plays(other);
    const bar = element("span", "", "bar");
    const filled = element("i");
    filled.style.width = `${100 * share}%`;
    bar.append(filled);
    button.append(
      element("span", String(rank), "rank"),
      element("span", printable(clip.name) + (button.disabled ? " (not in this page)" : ""), "name"),
      element("span", distance.toFixed(4), "distance"),
      bar,
    );
    button.addEventListener("click", () => this.play(other));
    const item = element("li");
    item.append(button);
    return item;
  }
}
