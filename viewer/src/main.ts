// The page: what plays, and what the panels say of it.
import { byId, element, printable } from "./dom.ts";
import { PageLibrary, type PlayedClip } from "./library.ts";
import { MotionMap } from "./map.ts";
import { FunctionPanel, NearestPanel } from "./panels.ts";
import { Renderer } from "./renderer.ts";
import { steer } from "./camera.ts";
import { cellsOf, Stage } from "./stage.ts";
import { darkness, Theme } from "./theme.ts";
import { Timeline } from "./timeline.ts";

const speeds = [0.1, 0.25, 0.5, 1, 1.5, 2];

class Page {
  private readonly library = new PageLibrary(document);
  private readonly theme = new Theme();
  private readonly stage: Stage;
  private readonly map: MotionMap;
  private readonly timeline: Timeline;
  private readonly functions: FunctionPanel;
  private readonly nearest: NearestPanel;
  private played: PlayedClip;
  private time = 0; // seconds
  private playing = false;
  private level: number;
  private readonly switches = { loop: true, follow: true, trails: false, ghost: false, compare: false };
  private last = 0;
  private dirty = true;

  constructor() {
    const first = this.library.overview.first ?? this.library.playable()[0];
    const played = first === undefined ? undefined : this.library.motion(first);
    if (!played) throw new Error("no clip of the library is in this page");
    this.played = played;
    this.level = played.motion.space.levels;
    const canvas = byId<HTMLCanvasElement>("canvas");
    this.stage = new Stage(canvas, Renderer.open(canvas), this.theme);
    this.map = new MotionMap(this.library, this.theme, (clip) => this.choose(clip));
    this.timeline = new Timeline((frame) => this.seek(frame));
    this.functions = new FunctionPanel(this.library, this.theme, (level) => this.setLevel(level));
    this.nearest = new NearestPanel(this.library, (clip) => this.choose(clip));
    steer(canvas, this.stage.camera, (panned) => {
      if (panned) this.stage.panned();
      this.dirty = true;
    });
    new ResizeObserver(() => this.relayout()).observe(byId("scene"));
    darkness.addEventListener("change", () => {
      this.map.relabel();
      this.choose(this.played.index, false);
    });
    this.sayLibrary();
    this.listen();
    this.choose(this.played.index);
    if (!window.matchMedia("(prefers-reduced-motion: reduce)").matches) this.setPlaying(true);
    requestAnimationFrame((now) => this.tick(now));
  }

  private sayLibrary(): void {
    const { overview } = this.library;
    const total = overview.clips.reduce((sum, clip) => sum + clip.frames / clip.rate, 0);
    const playable = this.library.playable().length;
    byId("library").textContent = printable(overview.library);
    document.title = `${printable(overview.library)} – kinespace`;
    byId("totals").textContent = `${overview.clips.length} clips, ${total < 120 ? `${total.toFixed(0)} s` : `${(total / 60).toFixed(0)} min`} of motion`;
    const left = byId("left-out");
    left.hidden = playable === overview.clips.length;
    left.textContent = `${playable} of them play here; the others are rings on the map`;
  }

  private listen(): void {
    byId("play").addEventListener("click", () => this.setPlaying(!this.playing));
    byId("back").addEventListener("click", () => this.step(-1));
    byId("forth").addEventListener("click", () => this.step(1));
    for (const name of Object.keys(this.switches) as (keyof typeof this.switches)[]) {
      byId(name).addEventListener("click", () => this.toggle(name));
    }
    const help = byId<HTMLDialogElement>("help");
    byId("help-open").addEventListener("click", () => help.showModal());
    document.addEventListener("keydown", (event) => this.key(event));
  }

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey || byId<HTMLDialogElement>("help").open) return;
    const target = event.target as HTMLElement;
    const typing = target.matches("input[type=search], select");
    const sliding = target.matches("input[type=range]");
    if (typing) return;
    const onButton = target.matches("button");
    const actions: Record<string, () => void> = {
      l: () => this.toggle("loop"),
      f: () => this.toggle("follow"),
      t: () => this.toggle("trails"),
      g: () => this.toggle("ghost"),
      c: () => this.toggle("compare"),
      n: () => this.neighbour(1),
      p: () => this.neighbour(-1),
      "+": () => this.setLevel(this.level + 1),
      "=": () => this.setLevel(this.level + 1),
      "-": () => this.setLevel(this.level - 1),
      ",": () => this.changeSpeed(-1),
      ".": () => this.changeSpeed(1),
      "/": () => byId("search").focus(),
      "?": () => byId<HTMLDialogElement>("help").showModal(),
    };
    if (!sliding) {
      actions["ArrowLeft"] = () => this.step(event.shiftKey ? -10 : -1);
      actions["ArrowRight"] = () => this.step(event.shiftKey ? 10 : 1);
      actions["Home"] = () => this.seek(0);
      actions["End"] = () => this.seek(this.played.clip.frames - 1);
    }
    if (!onButton) actions[" "] = () => this.setPlaying(!this.playing);
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  private choose(index: number, fromStart = true): void {
    const played = this.library.motion(index);
    if (!played) return;
    const all = this.level >= this.played.motion.space.levels;
    this.played = played;
    const levels = played.motion.space.levels;
    this.level = all ? levels : Math.min(this.level, levels);
    if (fromStart) this.time = 0;
    const { clip } = played;
    byId("clip-name").textContent = printable(clip.name);
    const labels = clip.labels.length ? ` · ${clip.labels.map(printable).join(", ")}` : "";
    byId("clip-facts").textContent = `${played.duration.toFixed(2)} s · ${clip.frames} frames at ${Number(clip.rate.toPrecision(4))} Hz${labels}`;
    this.stage.frame(played, this.switches.follow);
    this.timeline.show(played, this.theme);
    this.nearest.show(played);
    this.map.show(index, played.motion.data.nearest?.map(([clip]) => clip) ?? []);
    this.setLevel(this.level);
    this.relayout();
    this.sayGhost();
  }

  private neighbour(by: number): void {
    const playable = this.library.playable();
    const at = playable.indexOf(this.played.index);
    this.choose(playable[(at + by + playable.length) % playable.length]!);
  }

  private setLevel(level: number): void {
    this.level = Math.min(Math.max(1, level), this.played.motion.space.levels);
    this.functions.show(this.played, this.level);
    this.sayGhost();
    this.dirty = true;
  }

  private setPlaying(playing: boolean): void {
    this.playing = playing;
    document.body.classList.toggle("playing", playing);
    byId("play").setAttribute("aria-label", playing ? "Pause" : "Play");
    if (playing && !this.switches.loop && this.time >= this.played.duration) this.time = 0;
    this.dirty = true;
  }

  private changeSpeed(by: number): void {
    const select = byId<HTMLSelectElement>("speed");
    const at = speeds.indexOf(Number(select.value)) + by;
    if (speeds[at] !== undefined) select.value = String(speeds[at]);
  }

  private step(frames: number): void {
    this.setPlaying(false);
    this.seek(Math.round(this.time * this.played.clip.rate) + frames);
  }

  private seek(frame: number): void {
    const last = this.played.clip.frames - 1;
    this.time = Math.min(Math.max(0, frame), last) / this.played.clip.rate;
    this.dirty = true;
  }

  private toggle(name: keyof typeof this.switches): void {
    const button = byId<HTMLButtonElement>(name);
    if (button.disabled) return;
    this.switches[name] = !this.switches[name];
    button.setAttribute("aria-pressed", String(this.switches[name]));
    if (name === "follow") this.stage.frame(this.played, this.switches.follow);
    if (name === "compare") this.relayout();
    this.sayGhost();
    this.dirty = true;
  }

  // The clips that are in the scene: with its nearest, where these are to be beside it.
  private seen(): PlayedClip[] {
    if (!this.switches.compare) return [this.played];
    const others = (this.played.motion.data.nearest ?? []).flatMap(([clip]) => this.library.motion(clip) ?? []);
    return [this.played, ...others];
  }

  private sayGhost(): void {
    const says = byId("ghost-says");
    const { ghost, compare } = this.switches;
    says.hidden = !ghost || compare;
    says.textContent = this.played.original ? "Ghost: the clip as it was read from its file" : "Ghost: all functions, which stand for the original";
  }

  private relayout(): void {
    const comparing = this.switches.compare && this.seen().length > 1;
    document.body.classList.toggle("comparing", comparing);
    const captions = byId("captions");
    captions.replaceChildren();
    if (comparing) {
      const clips = this.seen();
      const cells = cellsOf(clips.length, captions.clientWidth, captions.clientHeight);
      clips.forEach((clip, i) => {
        const cell = cells[i]!;
        const caption = element("div", "", "caption");
        Object.assign(caption.style, { left: `${cell.x}px`, top: `${cell.y}px`, width: `${cell.width}px`, height: `${cell.height}px` });
        const distance = this.played.motion.data.nearest?.find(([other]) => i > 0 && other === clip.index);
        const what = distance === undefined ? "this clip" : `distance ${distance[1].toFixed(4)}`;
        caption.append(element("strong", printable(clip.clip.name)), element("span", what));
        captions.append(caption);
      });
    }
    this.dirty = true;
  }

  private tick(now: number): void {
    requestAnimationFrame((next) => this.tick(next));
    const elapsed = Math.min(0.1, (now - this.last) / 1000);
    this.last = now;
    if (this.playing) this.advance(elapsed * Number(byId<HTMLSelectElement>("speed").value));
    this.map.animate(now);
    if (!this.dirty) return;
    this.dirty = this.playing;
    const frame = this.time * this.played.clip.rate;
    this.timeline.at(frame);
    this.stage.draw({
      clips: this.seen(),
      share: this.played.duration > 0 ? this.time / this.played.duration : 0,
      level: this.level,
      follow: this.switches.follow,
      trails: this.switches.trails,
      ghost: this.switches.ghost,
    });
  }

  private advance(by: number): void {
    const { duration } = this.played;
    this.time += by;
    this.dirty = true;
    if (this.time < duration) return;
    if (this.switches.loop) {
      this.time = duration > 0 ? this.time % duration : 0;
    } else {
      this.time = duration;
      this.setPlaying(false);
    }
  }
}

function start(): void {
  try {
    new Page();
  } catch (error) {
    const trouble = byId("trouble");
    trouble.hidden = false;
    trouble.textContent = `This page cannot be shown: ${error instanceof Error ? error.message : String(error)}.`;
    if (document.getElementById("overview")) throw error;
  }
}

start();
