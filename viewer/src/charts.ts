// Small charts as SVG: errors by level, functions as curves, variance by function.
import { svg } from "./dom.ts";

const width = 380;
const left = 34;
const right = 6;
const top = 8;
const bottom = 18;

export interface Line {
  points: [x: number, y: number][];
  colour: string;
  name: string;
  thin?: boolean;
}

interface Frame {
  height: number;
  x: [low: number, high: number];
  y: [low: number, high: number];
  logarithmic: boolean;
}

function scales({ height, x, y, logarithmic }: Frame) {
  const f = logarithmic ? Math.log10 : (v: number) => v;
  const px = (v: number) => left + ((v - x[0]) / (x[1] - x[0] || 1)) * (width - left - right);
  const py = (v: number) => top + (1 - (f(v) - f(y[0])) / (f(y[1]) - f(y[0]) || 1)) * (height - top - bottom);
  return { px, py };
}

function empty(height: number, label: string): SVGElement {
  return svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
}

function decades([low, high]: [number, number]): number[] {
  const out: number[] = [];
  for (let e = Math.ceil(Math.log10(low) - 1e-9); e <= Math.log10(high) + 1e-9; ++e) out.push(10 ** e);
  const step = Math.ceil(out.length / 5);
  return out.filter((_, i) => (out.length - 1 - i) % step === 0);
}

function number(value: number): string {
  return value >= 0.01 && value < 10000 ? String(Number(value.toPrecision(2))) : `1e${Math.round(Math.log10(value))}`;
}

function addYAxis(chart: SVGElement, ticks: number[], py: (v: number) => number): void {
  for (const tick of ticks) {
    chart.append(svg("line", { class: "axis", x1: left, x2: width - right, y1: py(tick), y2: py(tick) }));
    chart.append(svg("text", { x: left - 5, y: py(tick) + 3.5, "text-anchor": "end" }, number(tick)));
  }
}

function addXLabels(chart: SVGElement, height: number, labels: [number, string][], px: (v: number) => number): void {
  for (const [value, text] of labels) {
    const anchor = px(value) > width - 40 ? "end" : px(value) < left + 20 ? "start" : "middle";
    chart.append(svg("text", { x: px(value), y: height - 4, "text-anchor": anchor }, text));
  }
}

function path(points: [number, number][], px: (v: number) => number, py: (v: number) => number): string {
  return points.map(([x, y], i) => `${i ? "L" : "M"}${px(x).toFixed(1)} ${py(y).toFixed(1)}`).join("");
}

// Errors on a logarithmic scale; `now` is the level that plays.
export function errorChart(lines: Line[], levels: number, now: number): SVGElement {
  const height = 150;
  const chart = empty(height, `Distance of joints by level of detail, from 1 to ${levels} functions`);
  const values = lines.flatMap((line) => line.points.map(([, y]) => y)).filter((y) => y > 0);
  if (values.length === 0) return chart;
  const range: [number, number] = [Math.min(...values) / 1.3, Math.max(...values) * 1.3];
  const { px, py } = scales({ height, x: [1, levels], y: range, logarithmic: true });
  addYAxis(chart, decades(range), py);
  addXLabels(chart, height, [[1, "1"], [levels, `${levels} functions`]], px);
  for (const line of lines) {
    const points = line.points.filter(([, y]) => y > 0);
    if (points.length === 0) continue;
    chart.append(svg("path", { d: path(points, px, py), fill: "none", stroke: line.colour, "stroke-width": line.thin ? 1.2 : 2, ...(line.thin ? { "stroke-dasharray": "3 3" } : {}) }));
    for (const [x, y] of points) if (!line.thin) chart.append(svg("circle", { cx: px(x), cy: py(y), r: 2.2, fill: line.colour }));
    const [x, y] = points.at(-1)!;
    chart.append(svg("text", { x: px(x), y: py(y) - 5, "text-anchor": "end", style: `fill:${line.colour}` }, line.name));
  }
  chart.append(svg("line", { class: "now", x1: px(now), x2: px(now), y1: top, y2: height - bottom }));
  return chart;
}

// Functions over a sequence's time, those that play in colour.
export function functionChart(functions: Float64Array[], playing: number, colours: string[], grey: string): SVGElement {
  const height = 130;
  const chart = empty(height, `The first ${functions.length} functions over the time of a sequence; ${Math.min(playing, functions.length)} of them play`);
  let most = 0;
  for (const f of functions) for (const v of f) most = Math.max(most, Math.abs(v));
  const { px, py } = scales({ height, x: [0, 1], y: [-most || -1, most || 1], logarithmic: false });
  chart.append(svg("line", { class: "axis", x1: left, x2: width - right, y1: py(0), y2: py(0) }));
  addXLabels(chart, height, [[0, "start of a sequence"], [1, "end"]], px);
  functions.forEach((f, k) => {
    const points = Array.from(f, (v, i): [number, number] => [i / (f.length - 1), v]);
    const on = k < playing;
    chart.append(svg("path", { d: path(points, px, py), fill: "none", stroke: on ? colours[k % colours.length]! : grey, "stroke-width": on ? 1.8 : 1, opacity: on ? 1 : 0.5 }));
  });
  return chart;
}

// Shares of the variance on a logarithmic scale, those that play in colour.
export function varianceChart(shares: number[], playing: number, colour: string, grey: string): SVGElement {
  const height = 120;
  const chart = empty(height, `Share of the variance by function, for ${shares.length} functions`);
  const seen = shares.map((share) => Math.max(share, 1e-12));
  if (seen.length === 0) return chart;
  const range: [number, number] = [Math.min(...seen) / 1.5, Math.max(...seen) * 1.2];
  const { px, py } = scales({ height, x: [0.5, seen.length + 0.5], y: range, logarithmic: true });
  addYAxis(chart, decades(range), py);
  addXLabels(chart, height, [[1, "1"], [seen.length, `function ${seen.length}`]], px);
  const bar = Math.max(1, ((width - left - right) / seen.length) * 0.72);
  seen.forEach((share, k) => {
    chart.append(svg("rect", { x: px(k + 1) - bar / 2, y: py(share), width: bar, height: Math.max(0, height - bottom - py(share)), rx: Math.min(1.5, bar / 3), fill: k < playing ? colour : grey, opacity: k < playing ? 0.9 : 0.45 }));
  });
  return chart;
}
