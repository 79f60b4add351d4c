// What is seen in three dimensions: the clip that plays, or that and its nearest side by side.
import { addBody, pointAt, type BodyColours } from "./body.ts";
import { OrbitCamera } from "./camera.ts";
import type { PlayedClip } from "./library.ts";
import type { Vector } from "./matrix.ts";
import { Capsules, Renderer, type View } from "./renderer.ts";
import type { Theme } from "./theme.ts";

export interface Scene {
  clips: PlayedClip[]; // the one that plays first
  share: number; // of the clips' length, 0 .. 1
  level: number;
  follow: boolean;
  trails: boolean;
  ghost: boolean;
}

export interface Cell {
  x: number;
  y: number;
  width: number;
  height: number;
}

// As many cells as there are clips, about as wide as high.
export function cellsOf(count: number, width: number, height: number): Cell[] {
  let columns = 1;
  const badness = (n: number) => {
    const rows = Math.ceil(count / n);
    return Math.abs(Math.log(width / n / (height / rows) / 0.85)) + 0.25 * (n * rows - count);
  };
  for (let n = 2; n <= count; ++n) if (badness(n) < badness(columns)) columns = n;
  const rows = Math.ceil(count / columns);
  return Array.from({ length: count }, (_, i) => ({
    x: ((i % columns) * width) / columns,
    y: (Math.floor(i / columns) * height) / rows,
    width: width / columns,
    height: height / rows,
  }));
}

export class Stage {
  readonly camera = new OrbitCamera();
  private pan: Vector = [0, 0, 0]; // by hand, beside what the camera goes with
  private aimed: Vector = [0, 0, 0]; // where the last picture looked
  private views: View[] = [];

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly renderer: Renderer,
    private readonly theme: Theme,
  ) {}

  // A new clip is looked at from the usual distance; a view that was moved goes back.
  frame(clip: PlayedClip, follow: boolean): void {
    this.pan = [0, 0, 0];
    const away = follow ? 0 : clip.extent().reach * 1.9;
    const narrow = Math.max(1, (1.05 * this.canvas.clientHeight) / Math.max(1, this.canvas.clientWidth));
    this.camera.distance = (clip.height * 2.25 + away) * narrow;
  }

  // The camera's target moves with the body; what the hand moved is kept beside it.
  panned(): void {
    for (let k = 0; k < 3; ++k) this.pan[k]! += this.camera.target[k]! - this.aimed[k]!;
    this.aimed = [...this.camera.target];
  }

  draw(scene: Scene): void {
    const cells = cellsOf(scene.clips.length, this.canvas.clientWidth, this.canvas.clientHeight);
    // The first one last, so that the camera is left as it stands for that.
    for (let i = scene.clips.length - 1; i >= 0; --i) this.fillView(scene, scene.clips[i]!, cells[i]!, i);
    this.views.length = scene.clips.length;
    this.renderer.draw(this.views, {
      background: this.theme.colour("scene"),
      grid: this.theme.colour("grid", 0.55),
      shadow: this.theme.colour("shadow", 0.2),
    });
  }

  private fillView(scene: Scene, clip: PlayedClip, cell: Cell, at: number): void {
    const { camera } = this;
    const frame = scene.share * (clip.clip.frames - 1);
    const aim = scene.follow || at > 0 ? clip.target(frame) : clip.extent().centre;
    const place: Vector = [aim[0] + this.pan[0], aim[1] + this.pan[1], aim[2] + this.pan[2]];
    // Clips are seen from the same side of where they looked at first.
    camera.heading = clip.motion.data.heading;
    camera.target = place;
    const view: View = (this.views[at] ??= {
      ...cell,
      camera: new Float32Array(16),
      eye: [0, 0, 0],
      ground: 0,
      centre: [0, 0, 0],
      reach: 0,
      solid: new Capsules(),
      ghost: new Capsules(),
      marks: new Capsules(),
    });
    Object.assign(view, cell, {
      camera: camera.matrix(cell.width / Math.max(1, cell.height)),
      eye: camera.eye(),
      ground: clip.ground - clip.height * 0.008,
      centre: aim,
      reach: Math.max(700, camera.distance * 1.9),
    });
    this.aimed = [...place];
    this.fillBodies(scene, clip, frame, view);
  }

  private fillBodies(scene: Scene, clip: PlayedClip, frame: number, view: View): void {
    const positions = clip.positions(scene.level);
    const colours: BodyColours = { body: this.theme.colour("body"), left: this.theme.colour("left"), right: this.theme.colour("right") };
    view.solid.clear();
    view.ghost.clear();
    view.marks.clear();
    addBody(clip.body, positions, clip.points, frame, colours, view.solid);
    if (scene.trails) this.addTrails(clip, positions, frame, view);
    if (scene.ghost) {
      const ghost = this.theme.colour("ghost", 0.5);
      const of = clip.original ?? clip.positions(-1);
      const points = clip.original ? clip.body.joints : clip.points;
      addBody(clip.body, of, points, frame, { body: ghost, left: ghost, right: ghost }, view.ghost, 0.92);
    }
    this.addContacts(clip, positions, frame, view);
  }

  // The last second of hands and feet, thinner the longer ago.
  private addTrails(clip: PlayedClip, positions: Float32Array, frame: number, view: View): void {
    const steps = 40;
    const length = clip.clip.rate * 1.1;
    for (const joint of clip.body.trails) {
      let later = pointAt(positions, clip.points, frame, joint);
      const side = clip.body.bones.find((bone) => bone.to === joint)?.side ?? "body";
      for (let i = 1; i <= steps; ++i) {
        const at = frame - (length * i) / steps;
        if (at < 0) break;
        const earlier = pointAt(positions, clip.points, at, joint);
        const left = 1 - i / steps;
        view.ghost.add(later, earlier, clip.height * 0.006 * (0.35 + left), clip.height * 0.006 * (0.3 + left), this.theme.colour(side, 0.75 * left + 0.1));
        later = earlier;
      }
    }
  }

  // Feet that stand have a ring on the ground.
  private addContacts(clip: PlayedClip, positions: Float32Array, frame: number, view: View): void {
    const feet = clip.motion.data.feet;
    if (!feet) return;
    for (const [slot, first, last] of feet.contacts) {
      const joint = feet.joints[slot];
      if (joint === undefined || joint < 0 || frame < first || frame > last + 1) continue;
      const [x, , z] = pointAt(positions, clip.points, frame, joint);
      const radius = clip.height * 0.04;
      const colour = this.theme.colour(slot < 2 ? "left" : "right", 0.85);
      const steps = 20;
      const on = (i: number): Vector => {
        const turn = (2 * Math.PI * i) / steps;
        return [x + radius * Math.cos(turn), view.ground + 0.4, z + radius * Math.sin(turn)];
      };
      for (let i = 0; i < steps; ++i) view.marks.add(on(i), on(i + 1), 0.45, 0.45, colour);
    }
  }
}
