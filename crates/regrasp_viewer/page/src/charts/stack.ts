// All charts on one time axis, with a cursor through each; hovering looks at a time, clicking keeps it.

import { el } from "../dom";
import type { Motion } from "../motion";
import type { Player } from "../player";
import { movingHand } from "../bodies";
import type { Story } from "../story";
import type { Theme } from "../theme";
import { Chart, RIGHT, type ChartSpec } from "./frame";
import { gaitChart } from "./gait";
import { clearanceChart, forceChart, jointChart, jointGroups, marginChart } from "./lines";

export class ChartStack {
  readonly element: HTMLElement;
  private readonly charts: Chart[];
  private readonly cursors: HTMLElement[];
  private left = 64;
  private width = 0;

  constructor(story: Story, private readonly motion: Motion, private readonly player: Player, theme: Theme) {
    const specs: ChartSpec[] = [gaitChart(story, motion)];
    if (story.judged) {
      // What slides closes nothing: a plan of tracking alone has no margin at all.
      if (!motion.isTracking || story.judged.margin.some((margin) => margin !== null)) specs.push(marginChart(story, motion));
      specs.push(clearanceChart(story, motion));
    }
    if (jointGroups(movingHand(story.scene)).length > 0) specs.push(jointChart(story, motion, () => this.draw()));
    if (motion.hasForces) specs.push(forceChart(story, motion));
    this.charts = specs.map((spec) => new Chart(spec, motion, theme));
    this.element = el("div", { class: "charts" }, ...this.charts.map((c) => c.element));
    this.cursors = [...this.element.querySelectorAll(".plot")].map((plot) => plot.appendChild(el("div", { class: "cursor", "aria-hidden": "true" })));
    if (!motion.hasForces) this.element.append(el("p", { class: "note" }, "This plan carries no contact forces."));
    this.listen();
    player.onTime((time) => this.show(time));
    theme.onChange(() => this.draw());
    new ResizeObserver(() => {
      if (this.element.clientWidth !== this.width) this.draw();
    }).observe(this.element);
  }

  draw(): void {
    this.width = this.element.clientWidth;
    this.left = this.width < 420 ? 56 : 84;
    for (const chart of this.charts) chart.draw(this.left);
    this.show(this.player.time);
  }

  private show(time: number): void {
    const span = Math.max(this.motion.end - this.motion.start, 1e-9);
    const inner = Math.max(1, this.width - this.left - RIGHT);
    const place = `translateX(${(this.left + ((time - this.motion.start) / span) * inner).toFixed(2)}px)`;
    for (const cursor of this.cursors) cursor.style.transform = place;
    for (const chart of this.charts) chart.show(time);
  }

  private timeAt(event: PointerEvent): number {
    const place = event.clientX - this.element.getBoundingClientRect().left - this.left;
    const inner = Math.max(1, this.width - this.left - RIGHT);
    return this.motion.start + (place / inner) * (this.motion.end - this.motion.start);
  }

  private listen(): void {
    let held = false;
    for (const plot of this.element.querySelectorAll<HTMLElement>(".plot")) {
      plot.addEventListener("pointermove", (event) => {
        if (held) this.player.seek(this.timeAt(event));
        else if (event.pointerType !== "touch") this.player.look(this.timeAt(event));
      });
      plot.addEventListener("pointerdown", (event) => {
        if (event.button !== 0) return;
        held = true;
        plot.setPointerCapture(event.pointerId);
        this.player.seek(this.timeAt(event));
      });
      for (const end of ["pointerup", "pointercancel"]) plot.addEventListener(end, () => { held = false; });
      plot.addEventListener("pointerleave", () => {
        if (!held) this.player.look(null);
      });
    }
  }
}
