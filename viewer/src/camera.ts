// A camera that turns about a point: by mouse, touch and keys.
import { lookAt, multiply, normalised, perspective, type Matrix, type Vector } from "./matrix.ts";

const fieldOfView = (38 * Math.PI) / 180;

export class OrbitCamera {
  heading = 0; // of what is looked at
  azimuth = 0.65; // from there
  elevation = 0.2;
  distance = 420;
  target: Vector = [0, 90, 0];

  eye(): Vector {
    const flat = Math.cos(this.elevation) * this.distance;
    const turn = this.heading + this.azimuth;
    return [
      this.target[0] + flat * Math.sin(turn),
      this.target[1] + Math.sin(this.elevation) * this.distance,
      this.target[2] + flat * Math.cos(turn),
    ];
  }

  matrix(aspect: number): Matrix {
    return multiply(perspective(fieldOfView, aspect, this.distance / 50, this.distance * 40), lookAt(this.eye(), this.target));
  }

  orbit(dx: number, dy: number): void {
    this.azimuth -= dx * 0.008;
    this.elevation = Math.min(1.5, Math.max(-0.08, this.elevation + dy * 0.006));
  }

  zoom(factor: number): void {
    this.distance = Math.min(6000, Math.max(40, this.distance * factor));
  }

  pan(dx: number, dy: number): void {
    const scale = this.distance / 700;
    const right = normalised([Math.cos(this.heading + this.azimuth), 0, -Math.sin(this.heading + this.azimuth)]);
    for (let k = 0; k < 3; ++k) this.target[k]! -= right[k]! * dx * scale;
    this.target[1] += dy * scale;
  }
}

// One finger or the left button turns, two fingers or the right button move and zoom, the wheel zooms.
export function steer(element: HTMLElement, camera: OrbitCamera, moved: (panned: boolean) => void): void {
  const pointers = new Map<number, { x: number; y: number }>();
  element.addEventListener("pointerdown", (event) => {
    element.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  const release = (event: PointerEvent) => pointers.delete(event.pointerId);
  element.addEventListener("pointerup", release);
  element.addEventListener("pointercancel", release);
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before.x;
    const dy = event.clientY - before.y;
    const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
    if (other) {
      const apart = (p: { x: number; y: number }) => Math.hypot(p.x - other.x, p.y - other.y) || 1;
      camera.zoom(apart(before) / apart({ x: event.clientX, y: event.clientY }));
      camera.pan(dx / 2, dy / 2);
    } else if ((event.buttons & 2) !== 0 || event.shiftKey) {
      camera.pan(dx, dy);
    } else {
      camera.orbit(dx, dy);
    }
    before.x = event.clientX;
    before.y = event.clientY;
    moved(other !== undefined || (event.buttons & 2) !== 0 || event.shiftKey);
  });
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      camera.zoom(Math.exp(event.deltaY * 0.0012));
      moved(false);
    },
    { passive: false },
  );
}
