"use strict";
/* A machine with its name and its gauges. */

const DEGREES = 180 / Math.PI;

class Machine {
  /**
   * @param {object} scene Of `scene_of`.
   * @param {string} name Of the policy.
   * @param {string} color Of the policy.
   * @param {(panel: HTMLElement) => void} place Puts the panel into the page.
   */
  constructor(scene, name, color, place) {
    this.scene = scene;
    this.color = color;
    this.panel = document.querySelector("template.machine").content.firstElementChild.cloneNode(true);
    this.panel.style.setProperty("--policy", color);
    const find = (selector) => this.panel.querySelector(selector);
    this.score = find(".score");
    this.travel = find(".travel");
    this.bars = [...this.panel.querySelectorAll(".leg i")];
    place(this.panel);
    this.stage = new Stage(find(".picture"), scene, color);
    this.stage.canvas.setAttribute("role", "img");
    this.rename(name);
  }

  rename(name) {
    this.panel.querySelector(".name").textContent = name;
    this.stage.canvas.setAttribute("aria-label", `The machine as ${name} moves it`);
  }

  /** Pose of the nine axes, and the specific forces in car and simulator. */
  move(pose, reference, simulated) {
    const { stage, scene } = this;
    stage.pose(pose);
    stage.cues(reference, simulated);
    this.bars.forEach((bar, i) => {
      const use = stage.use[i], size = Math.min(Math.abs(use), 1);
      bar.style.height = `${(50 * size).toFixed(1)}%`;
      bar.style[use >= 0 ? "bottom" : "top"] = "50%";
      bar.style[use >= 0 ? "top" : "bottom"] = "auto";
      bar.style.background = `rgb(${stage.color(use)})`;
    });
    const parts = [];
    if (scene.carriage) parts.push(`carriage ${Charts.number(pose[0])}, ${Charts.number(pose[1])} m`);
    if (scene.turntable) parts.push(`turntable ${Charts.number(pose[8] * DEGREES)}°`);
    const text = parts.join(" · ");
    if (this.travel.textContent !== text) this.travel.textContent = text;
  }

  remove() {
    this.stage.dispose();
    this.panel.remove();
  }
}
