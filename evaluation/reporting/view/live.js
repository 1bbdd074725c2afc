"use strict";
/* A machine that moves now: each event of the stream is a moment of it. */
(async () => {
  const byId = (id) => document.getElementById(id);
  const about = JSON.parse(byId("about").textContent);
  const scene = JSON.parse(new TextDecoder().decode(await inflated(byId("scene").textContent.trim())));
  const WINDOW = 20, COLOR = "#0072b2";
  const machine = new Machine(scene, about.policy, COLOR, (panel) => document.querySelector(".stages").append(panel));
  machine.stage.controls.addEventListener("change", () => machine.stage.render());
  const charts = new Charts(document.querySelector(".charts"), [
    { title: "Forward force", unit: "m/s²", least: 1 }, { title: "Lateral force", unit: "m/s²", least: 1 },
    { title: "Yaw rate", unit: "deg/s", least: 5 },
  ]);
  const rows = [];
  let frames = 0, drawn = 0, waiting = 0, begin;

  function plot() {
    if (rows.length < 2) return;
    const time = rows.map((row) => row.time), last = time[time.length - 1];
    const line = (name, label, color, width) => ({
      time, label, color, width,
      values: [0, 1, 5].map((k) => rows.map((row) => row[name][k] * (k === 5 ? DEGREES : 1))),
    });
    charts.moment = last;
    charts.show([line("reference", "car", "#1a1a1a", 2.2), line("simulated", about.policy, COLOR, 1.6)]);
  }

  const stream = new EventSource("/frames");
  stream.onmessage = (event) => {
    const row = JSON.parse(event.data);
    // Seconds since the page was opened.
    row.time -= begin ??= row.time;
    frames++;
    rows.push(row);
    while (rows[0].time < row.time - WINDOW) rows.shift();
    // A browser that is slower than the stream draws the newest only.
    waiting ||= requestAnimationFrame(draw);
  };

  function draw() {
    waiting = 0;
    const row = rows[rows.length - 1];
    machine.move(row.position, row.reference, row.simulated);
    machine.stage.render();
    byId("state").textContent = about.states[row.state];
    // Plots are made anew twice a second.
    if (performance.now() - drawn > 500) {
      drawn = performance.now();
      plot();
    }
    window.motionCueingLive = { machine, row, frames };
    window.ready = true;
  }
  stream.onerror = () => { byId("state").textContent = "The controller has ended, or cannot be reached."; };
})();
