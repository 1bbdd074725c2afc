"use strict";
/* Plots over time beside a machine, with a line at the moment shown. */

const CHART_FONT = '12px system-ui, "Segoe UI", Roboto, Helvetica, Arial, sans-serif';

class Charts {
  /**
   * @param {HTMLElement} holder Where they are.
   * @param {{title: string, unit: string, least?: number, log?: boolean}[]} panels What they show.
   * @param {(time: number) => void} seek Called with the moment that a person points at.
   * @param {boolean} plain Whether there is no moment to mark.
   */
  constructor(holder, panels, seek = null, plain = false) {
    this.holder = holder;
    this.seek = seek;
    this.plain = plain;
    this.moment = null;
    this.charts = [];
    this.panels = panels.map((panel) => {
      const caption = document.createElement("figcaption"), box = document.createElement("div");
      const figure = document.createElement("figure");
      const title = document.createElement("span"), values = document.createElement("span");
      title.textContent = panel.unit ? `${panel.title}, ${panel.unit}` : panel.title;
      values.className = "values";
      caption.append(title, values);
      figure.className = "plot";
      box.className = "chart";
      figure.append(caption, box);
      holder.append(figure);
      return { ...panel, box, values, figure };
    });
    let timer = 0;
    new ResizeObserver(() => {
      clearTimeout(timer);
      timer = setTimeout(() => {
        this.charts.forEach((u, i) => {
          const width = this.panels[i].box.clientWidth;
          if (u && width && width !== u.width) u.setSize({ width, height: u.height });
        });
      }, 80);
    }).observe(holder);
  }

  /** Show lines; each has for every panel its values, and a time, a label, a color and a dash. */
  show(lines) {
    this.lines = lines;
    this.charts.forEach((u) => u?.destroy());
    this.charts = this.panels.map((panel, p) => this.make(panel, p));
    if (!this.plain) this.mark(this.moment ?? lines[0].time[0]);
  }

  make(panel, p) {
    const shown = this.lines.filter((line) => line.values[p]);
    panel.shown = shown;
    panel.figure.hidden = !shown.length;
    if (!shown.length) return null;
    const data = shown.every((line) => line.time === shown[0].time)
      ? [shown[0].time, ...shown.map((line) => line.values[p])]
      : uPlot.join(shown.map((line) => [line.time, line.values[p]]));
    const axis = (side, more) => ({
      side, stroke: "#566070", font: CHART_FONT, grid: { stroke: "#e9edf1", width: 1 },
      ticks: { stroke: "#e9edf1", width: 1, size: 4 }, ...more,
    });
    const u = new uPlot({
      width: Math.max(panel.box.clientWidth, 180), height: 138, padding: [6, 8, 0, 0],
      scales: {
        x: { time: false },
        y: {
          distr: panel.log ? 3 : 1,
          range: (_, low, high) => {
            if (low === null || low === undefined) return [0, 1];
            if (panel.log) return [low / 1.2, high * 1.2];
            // A line of one value has room, too.
            const least = panel.least || Math.max(0.02 * Math.abs(high), 1e-3);
            const lack = Math.max(least - (high - low), 0) / 2, room = 0.06 * (high - low);
            return [low - lack - room, high + lack + room];
          },
        },
      },
      axes: [
        axis(2, { size: 24, values: (_, ticks) => ticks.map((t) => `${+t.toPrecision(6)}`) }),
        axis(3, { size: 50, values: (_, ticks) => ticks.map((t) => (t === null ? "" : `${+t.toPrecision(3)}`)) }),
      ],
      series: [{}, ...shown.map((line) => ({
        stroke: line.color, width: line.width || 1.6, dash: line.dash || [], points: { show: false }, spanGaps: true,
      }))],
      legend: { show: false },
      cursor: { show: false },
      hooks: { draw: [(one) => this.line(one)] },
    }, data, panel.box);
    u.over.setAttribute("aria-hidden", "true");
    if (this.seek) {
      const point = (event) => {
        const t = u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x");
        this.seek(Math.min(Math.max(t, u.data[0][0]), u.data[0][u.data[0].length - 1]));
      };
      u.over.style.cursor = "col-resize";
      u.over.addEventListener("pointerdown", (event) => {
        u.over.setPointerCapture(event.pointerId);
        point(event);
      });
      u.over.addEventListener("pointermove", (event) => { if (event.buttons & 1) point(event); });
    }
    return u;
  }

  line(u) {
    if (this.moment === null) return;
    const { ctx, bbox } = u, x = Math.round(u.valToPos(this.moment, "x", true)) + 0.5;
    if (x < bbox.left || x > bbox.left + bbox.width) return;
    ctx.save();
    ctx.strokeStyle = "#00619a";
    ctx.lineWidth = 1.5 * devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }

  /** Draw the line at a moment, and write the values there. */
  mark(time) {
    this.moment = time;
    this.panels.forEach((panel, p) => {
      const u = this.charts[p];
      if (!u) return;
      u.redraw(false);
      panel.values.replaceChildren(...panel.shown.map((line) => {
        const value = document.createElement("b");
        value.style.borderBottom = `3px solid ${line.color}`;
        value.textContent = Charts.number(interpolate(line.time, line.values[p], time));
        value.title = line.label;
        return value;
      }));
    });
  }

  static number(x) {
    if (x === null || Number.isNaN(x)) return "–";
    const size = Math.abs(x), text = x.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : 2);
    return (+text === 0 ? text.replace("-", "") : text).replace("-", "−");
  }
}

/** Index of the last time that is not later than t, at most the last but one. */
function indexAt(time, t) {
  let low = 0, high = time.length - 2;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (time[middle] <= t) low = middle; else high = middle - 1;
  }
  return low;
}

/** A value between two samples, the ends beyond them. */
function interpolate(time, values, t) {
  if (time.length < 2) return values[0];
  const k = indexAt(time, t), share = Math.min(Math.max((t - time[k]) / (time[k + 1] - time[k]), 0), 1);
  if (values[k] === null || values[k + 1] === null) return values[k];
  return values[k] + share * (values[k + 1] - values[k]);
}
