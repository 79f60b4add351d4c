// Where the clip is, and when its feet stand.
import { byId, element, seconds } from "./dom.ts";
import type { PlayedClip } from "./library.ts";
import type { Theme } from "./theme.ts";

const slots = ["Left ankle", "Left toe", "Right ankle", "Right toe"];
const thumb = 8; // half of it: bars and track begin so far in

export class Timeline {
  private readonly scrub = byId<HTMLInputElement>("scrub");
  private readonly timeline = byId("timeline");
  private clip: PlayedClip | undefined;
  private bars: { bar: HTMLElement; first: number; last: number }[] = [];

  constructor(seek: (frame: number) => void) {
    this.scrub.addEventListener("input", () => seek(Number(this.scrub.value)));
  }

  show(clip: PlayedClip, theme: Theme): void {
    this.clip = clip;
    const last = clip.clip.frames - 1;
    this.scrub.max = String(last);
    this.bars = [];
    const feet = clip.motion.data.feet;
    this.timeline.classList.toggle("no-contacts", !feet);
    const rows: HTMLElement[] = [];
    feet?.joints.forEach((joint, slot) => {
      if (joint < 0) return;
      const row = element("div", "", "row");
      const bars = element("div", "", "bars");
      for (const [of, first, end] of feet.contacts) {
        if (of !== slot) continue;
        const bar = element("i", "", "bar");
        const share = (frame: number) => `${(100 * frame) / Math.max(1, last)}%`;
        Object.assign(bar.style, { left: share(first), width: share(end - first), background: theme.text(slot < 2 ? "left" : "right") });
        bars.append(bar);
        this.bars.push({ bar, first, last: end });
      }
      row.append(element("span", slots[slot]), bars);
      rows.push(row);
    });
    const contacts = byId("contacts");
    contacts.replaceChildren(...rows);
    contacts.hidden = rows.length === 0;
    contacts.setAttribute("aria-label", `When feet stand: ${this.bars.length} contacts`);
  }

  at(frame: number): void {
    if (!this.clip) return;
    const last = Math.max(1, this.clip.clip.frames - 1);
    const whole = Math.round(frame);
    this.scrub.value = String(whole);
    this.scrub.style.setProperty("--done", `${(100 * frame) / last}%`);
    this.scrub.setAttribute("aria-valuetext", `frame ${whole}, ${seconds(frame / this.clip.clip.rate)}`);
    byId("time").textContent = `${seconds(frame / this.clip.clip.rate)} · ${whole}`;
    for (const { bar, first, last: end } of this.bars) bar.classList.toggle("now", frame >= first && frame <= end);
    const { offsetLeft, offsetWidth } = this.scrub;
    byId("playhead").style.left = `${offsetLeft + thumb + ((offsetWidth - 2 * thumb) * frame) / last}px`;
  }
}
