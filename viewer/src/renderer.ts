// Capsules on a ground with a grid, by WebGL 2: one draw call for all bones of a view.
import type { Matrix, Vector } from "./matrix.ts";

export type Colour = [red: number, green: number, blue: number, alpha: number]; // 0 .. 1

const floatsPerCapsule = 12; // a, radius, b, radius, colour

// Capsules that are drawn together.
export class Capsules {
  private data = new Float32Array(256 * floatsPerCapsule);
  count = 0;

  clear(): void {
    this.count = 0;
  }

  add(a: Vector, b: Vector, radiusA: number, radiusB: number, colour: Colour): void {
    if ((this.count + 1) * floatsPerCapsule > this.data.length) {
      const larger = new Float32Array(this.data.length * 2);
      larger.set(this.data);
      this.data = larger;
    }
    this.data.set([...a, radiusA, ...b, radiusB, ...colour], this.count * floatsPerCapsule);
    ++this.count;
  }

  get values(): Float32Array {
    return this.data.subarray(0, this.count * floatsPerCapsule);
  }
}

export interface View {
  x: number; // CSS pixels from the left and the top of the canvas
  y: number;
  width: number;
  height: number;
  camera: Matrix;
  eye: Vector;
  ground: number; // its height, cm
  centre: Vector; // about which the grid fades
  reach: number; // how far the grid goes, cm
  solid: Capsules;
  ghost: Capsules; // seen through
  marks: Capsules; // on the ground, flat
}

export interface Scenery {
  background: Colour;
  grid: Colour;
  shadow: Colour;
}

const capsuleVertex = `#version 300 es
layout(location=0) in vec4 place; // direction on the unit sphere, and which end
layout(location=1) in vec4 from;
layout(location=2) in vec4 to;
layout(location=3) in vec4 tint;
uniform mat4 camera;
uniform float ground;
uniform float flatness; // 1: the shadow on the ground
out vec3 normal;
out vec3 world;
out vec4 colour;
void main() {
  vec3 axis = to.xyz - from.xyz;
  float len = length(axis);
  vec3 up = len > 1e-4 ? axis / len : vec3(0.0, 1.0, 0.0);
  vec3 side = normalize(abs(up.y) > 0.9 ? cross(up, vec3(1.0, 0.0, 0.0)) : cross(up, vec3(0.0, 1.0, 0.0)));
  vec3 front = cross(side, up);
  normal = side * place.x + up * place.y + front * place.z;
  vec3 p = mix(from.xyz, to.xyz, place.w) + normal * mix(from.w, to.w, place.w);
  if (flatness > 0.5) {
    float h = max(p.y - ground, 0.0);
    p = vec3(p.x - 0.22 * h, ground + 0.05, p.z - 0.12 * h);
  }
  world = p;
  colour = tint;
  gl_Position = camera * vec4(p, 1.0);
}`;

const capsuleFragment = `#version 300 es
precision highp float;
in vec3 normal;
in vec3 world;
in vec4 colour;
uniform vec3 eye;
uniform float flatness;
uniform vec4 shadow;
out vec4 pixel;
void main() {
  if (flatness > 0.5) {
    pixel = shadow;
    return;
  }
  vec3 n = normalize(normal);
  vec3 v = normalize(eye - world);
  // The light stands to the right of whoever looks, and above.
  vec3 front = normalize(vec3(v.x, 0.0, v.z) + vec3(1e-4));
  vec3 key = normalize(vec3(0.0, 0.8, 0.0) + 0.6 * front + 0.4 * vec3(front.z, 0.0, -front.x));
  float light = 0.66 + 0.1 * n.y + 0.42 * max(dot(n, key), 0.0);
  float rim = pow(1.0 - max(dot(n, v), 0.0), 3.0);
  float gloss = pow(max(dot(n, normalize(key + v)), 0.0), 42.0);
  vec3 lit = colour.rgb * light + vec3(0.06) * rim + vec3(0.16) * gloss;
  pixel = vec4(lit * colour.a, colour.a);
}`;

const groundVertex = `#version 300 es
layout(location=0) in vec2 corner;
uniform mat4 camera;
uniform vec3 centre;
uniform float reach;
uniform float ground;
out vec3 world;
void main() {
  world = vec3(centre.x + corner.x * reach, ground, centre.z + corner.y * reach);
  gl_Position = camera * vec4(world, 1.0);
}`;

const groundFragment = `#version 300 es
precision highp float;
in vec3 world;
uniform vec3 centre;
uniform float reach;
uniform vec4 grid;
out vec4 pixel;
float lines(vec2 p, float width) {
  vec2 d = abs(fract(p - 0.5) - 0.5) / max(fwidth(p), vec2(1e-6));
  return 1.0 - min(min(d.x, d.y) / width, 1.0);
}
void main() {
  float away = length(world.xz - centre.xz) / reach;
  float fade = pow(max(1.0 - away, 0.0), 1.6);
  float line = max(lines(world.xz / 100.0, 1.1), 0.38 * lines(world.xz / 50.0, 1.0));
  float a = grid.a * fade * line;
  pixel = vec4(grid.rgb * a, a);
}`;

function program(gl: WebGL2RenderingContext, vertex: string, fragment: string): WebGLProgram {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]] as const) {
    const shader = gl.createShader(kind);
    if (!shader) throw new Error("no shader");
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) ?? "shader");
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) ?? "program");
  return made;
}

// A sphere cut at its equator, with which end each half belongs to: pulled apart it is a capsule.
function capsuleMesh(): { vertices: Float32Array; indices: Uint16Array } {
  const around = 14;
  const rings = 4; // from equator to pole
  const vertices: number[] = [];
  const latitudes: [angle: number, end: number][] = [];
  for (let i = 0; i <= rings; ++i) latitudes.push([(-Math.PI / 2) * (1 - i / rings), 0]);
  for (let i = 0; i <= rings; ++i) latitudes.push([(Math.PI / 2) * (i / rings), 1]);
  for (const [angle, end] of latitudes) {
    for (let k = 0; k <= around; ++k) {
      const turn = (2 * Math.PI * k) / around;
      vertices.push(Math.cos(angle) * Math.cos(turn), Math.sin(angle), Math.cos(angle) * Math.sin(turn), end);
    }
  }
  const indices: number[] = [];
  const row = around + 1;
  for (let i = 0; i + 1 < latitudes.length; ++i) {
    for (let k = 0; k < around; ++k) {
      const a = i * row + k;
      indices.push(a, a + row, a + 1, a + 1, a + row, a + row + 1);
    }
  }
  return { vertices: new Float32Array(vertices), indices: new Uint16Array(indices) };
}

export class Renderer {
  private readonly capsule: WebGLProgram;
  private readonly ground: WebGLProgram;
  private readonly capsuleArray: WebGLVertexArrayObject;
  private readonly groundArray: WebGLVertexArrayObject;
  private readonly instances: WebGLBuffer;
  private readonly indices: number;
  private readonly places = new Map<WebGLProgram, Map<string, WebGLUniformLocation | null>>();

  // Throws where there is no WebGL 2.
  static open(canvas: HTMLCanvasElement): Renderer {
    const gl = canvas.getContext("webgl2", { antialias: true, stencil: true, premultipliedAlpha: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    return new Renderer(gl, canvas);
  }

  private constructor(
    private readonly gl: WebGL2RenderingContext,
    private readonly canvas: HTMLCanvasElement,
  ) {
    this.capsule = program(gl, capsuleVertex, capsuleFragment);
    this.ground = program(gl, groundVertex, groundFragment);
    const mesh = capsuleMesh();
    this.indices = mesh.indices.length;
    this.capsuleArray = gl.createVertexArray();
    gl.bindVertexArray(this.capsuleArray);
    this.fill(gl.ARRAY_BUFFER, mesh.vertices);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 0, 0);
    this.fill(gl.ELEMENT_ARRAY_BUFFER, mesh.indices);
    this.instances = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    for (let k = 0; k < 3; ++k) {
      gl.enableVertexAttribArray(1 + k);
      gl.vertexAttribPointer(1 + k, 4, gl.FLOAT, false, floatsPerCapsule * 4, k * 16);
      gl.vertexAttribDivisor(1 + k, 1);
    }
    this.groundArray = gl.createVertexArray();
    gl.bindVertexArray(this.groundArray);
    this.fill(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    gl.bindVertexArray(null);
    gl.enable(gl.SCISSOR_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  draw(views: View[], scenery: Scenery): void {
    const { gl, canvas } = this;
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * scale);
    const height = Math.round(canvas.clientHeight * scale);
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    gl.scissor(0, 0, width, height);
    const [r, g, b] = scenery.background;
    gl.clearColor(r, g, b, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    for (const view of views) {
      const box = [view.x, canvas.clientHeight - view.y - view.height, view.width, view.height].map((v) => Math.round(v * scale));
      gl.viewport(box[0]!, box[1]!, box[2]!, box[3]!);
      gl.scissor(box[0]!, box[1]!, box[2]!, box[3]!);
      this.drawView(view, scenery);
    }
  }

  private drawView(view: View, scenery: Scenery): void {
    const { gl } = this;
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(false);
    this.drawGround(view, scenery);
    gl.useProgram(this.capsule);
    gl.uniformMatrix4fv(this.at(this.capsule, "camera"), false, view.camera);
    gl.uniform3fv(this.at(this.capsule, "eye"), view.eye);
    gl.uniform1f(this.at(this.capsule, "ground"), view.ground);
    this.drawShadow(view, scenery);
    gl.uniform1f(this.at(this.capsule, "flatness"), 0);
    this.drawCapsules(view.marks);
    gl.depthMask(true);
    this.drawCapsules(view.solid);
    // Depth first, so that what is seen through a ghost is what is behind all of it.
    gl.colorMask(false, false, false, false);
    this.drawCapsules(view.ghost);
    gl.colorMask(true, true, true, true);
    gl.depthFunc(gl.LEQUAL);
    this.drawCapsules(view.ghost);
    gl.depthFunc(gl.LESS);
  }

  private drawShadow(view: View, scenery: Scenery): void {
    const { gl } = this;
    gl.uniform1f(this.at(this.capsule, "flatness"), 1);
    gl.uniform4fv(this.at(this.capsule, "shadow"), premultiplied(scenery.shadow));
    gl.enable(gl.STENCIL_TEST); // limbs over each other darken once
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    this.drawCapsules(view.solid);
    gl.disable(gl.STENCIL_TEST);
  }

  private drawGround(view: View, scenery: Scenery): void {
    const { gl } = this;
    gl.useProgram(this.ground);
    gl.uniformMatrix4fv(this.at(this.ground, "camera"), false, view.camera);
    gl.uniform3fv(this.at(this.ground, "centre"), view.centre);
    gl.uniform1f(this.at(this.ground, "reach"), view.reach);
    gl.uniform1f(this.at(this.ground, "ground"), view.ground);
    gl.uniform4fv(this.at(this.ground, "grid"), scenery.grid);
    gl.bindVertexArray(this.groundArray);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  private drawCapsules(capsules: Capsules): void {
    const { gl } = this;
    if (capsules.count === 0) return;
    gl.bindVertexArray(this.capsuleArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, capsules.values, gl.DYNAMIC_DRAW);
    gl.drawElementsInstanced(gl.TRIANGLES, this.indices, gl.UNSIGNED_SHORT, 0, capsules.count);
  }

  private fill(target: number, data: AllowSharedBufferSource): void {
    const buffer = this.gl.createBuffer();
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, data, this.gl.STATIC_DRAW);
  }

  private at(of: WebGLProgram, name: string): WebGLUniformLocation | null {
    let known = this.places.get(of);
    if (!known) this.places.set(of, (known = new Map()));
    if (!known.has(name)) known.set(name, this.gl.getUniformLocation(of, name));
    return known.get(name)!;
  }
}

function premultiplied([r, g, b, a]: Colour): Colour {
  return [r * a, g * a, b * a, a];
}
