"use strict";
/* A drive that plays: one or two machines, the car on its road, the moment, and plots over time. */

const CAR_COLOR = "#1a1a1a", FRAME = 1 / 30;

/** A packed drive with its arrays. */
async function unpackDrive(content, missing) {
  const arrays = await unpackArrays(content, missing);
  const of = (one) => ({
    ...one, time: arrays[one.time], force: one.force.map((i) => arrays[i]), rate: one.rate.map((i) => arrays[i]),
    ...(one.pose ? { pose: one.pose.map((i) => arrays[i]) } : {}),
  });
  const policies = {};
  for (const [name, one] of Object.entries(content.policies)) policies[name] = of(one);
  const road = content.road && Object.fromEntries(
    Object.entries(content.road).map(([name, i]) => [name, arrays[i]]));
  return { ...content, data: null, car: of(content.car), road, policies };
}

class Film {
  /**
   * @param {HTMLElement} root With the elements of `film.html`.
   * @param {object} scene Of `scene_of`.
   * @param {(name: string) => {color: string, dash: number[]}} style Of a policy.
   */
  constructor(root, scene, style) {
    this.root = root;
    this.scene = scene;
    this.style = style;
    this.find = (selector) => root.querySelector(selector);
    this.time = 0;
    this.playing = false;
    this.speed = 1;
    this.stages = [];
    this.mode = "outside";
    this.map = this.find(".map");
    this.scrubber = this.find(".scrubber");
    this.charts = new Charts(this.find(".charts"), [
      { title: "Forward force", unit: "m/s²", least: 1 }, { title: "Lateral force", unit: "m/s²", least: 1 },
      { title: "Yaw rate", unit: "deg/s", least: 5 },
    ], (time) => this.seek(time));
    this.scrubber.addEventListener("input", () => this.seek(+this.scrubber.value));
    this.find(".play").addEventListener("click", () => this.toggle());
    this.find(".speed").addEventListener("change", (event) => { this.speed = +event.target.value; });
    this.find(".outside").addEventListener("click", () => this.view("outside"));
    this.find(".driver").addEventListener("click", () => this.view("driver"));
    this.find(".home").addEventListener("click", () => {
      this.view("outside");
      for (const { stage } of this.stages) stage.reset();
      this.draw();
    });
    document.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.drawMap()).observe(this.map);
  }

  /** Show policies of a drive, one beside the other; the moment stays where the drive is the same. */
  show(drive, names) {
    const again = this.drive && this.drive.name === drive.name;
    this.drive = drive;
    this.names = names;
    const [first, last] = drive.duration;
    Object.assign(this.scrubber, { min: first, max: last, step: 0.01 });
    this.machines(names);
    const lines = (one, label, color, dash, width) => ({
      time: one.time, label, color, dash, width, values: [one.force[0], one.force[1], one.rate[2].map((w) => w * DEGREES)],
    });
    this.charts.moment = null;
    this.charts.show([
      lines(drive.car, "car", CAR_COLOR, [], 2.2),
      ...names.map((name) => {
        const { color, dash } = this.style(name);
        return lines(drive.policies[name], name, color, dash, 1.6);
      }),
    ]);
    this.map.hidden = !drive.road;
    this.seek(again ? this.time : first);
  }

  machines(names) {
    const holder = this.find(".stages");
    holder.classList.toggle("pair", names.length > 1);
    while (this.stages.length > names.length) this.stages.pop().remove();
    names.forEach((name, i) => {
      const { color } = this.style(name), known = this.stages[i];
      if (known && known.color === color) {
        known.rename(name);
        return;
      }
      const machine = new Machine(this.scene, name, color, (panel) => {
        if (known) known.panel.replaceWith(panel); else holder.append(panel);
      });
      known?.stage.dispose();
      const { stage } = machine, other = this.stages[i ? 0 : 1]?.stage;
      stage.view(this.mode);
      if (other) {
        stage.camera.position.copy(other.camera.position);
        stage.controls.target.copy(other.controls.target);
        stage.place = [...other.place];
        stage.controls.update();
      }
      this.stages[i] = machine;
      stage.controls.addEventListener("change", () => this.together(stage));
      stage.onView = () => this.together(stage);
    });
    this.stages.forEach((machine, i) => {
      const { error } = this.drive.policies[names[i]];
      machine.score.textContent = error === undefined ? "" : `J ${Charts.number(error)}`;
    });
  }

  /** The machines are seen from the same place beside each. */
  together(stage) {
    if (this.aligning || this.mode === "driver") return;
    this.aligning = true;
    for (const { stage: other } of this.stages) {
      if (other === stage) continue;
      const move = (to, from) => to.set(
        from.x + 0.93 * (other.place[0] - stage.place[0]), from.y + 0.93 * (other.place[1] - stage.place[1]), from.z);
      move(other.camera.position, stage.camera.position);
      move(other.controls.target, stage.controls.target);
      other.controls.update();
    }
    this.aligning = false;
    this.draw();
  }

  view(mode) {
    this.mode = mode;
    this.find(".outside").setAttribute("aria-pressed", mode === "outside");
    this.find(".driver").setAttribute("aria-pressed", mode === "driver");
    for (const { stage } of this.stages) stage.view(mode);
    this.draw();
  }

  /* ---- time ---- */

  seek(time) {
    const [first, last] = this.drive.duration;
    this.time = Math.min(Math.max(time, first), last);
    this.scrubber.value = this.time;
    const text = `${this.time.toFixed(2)} s`;
    this.scrubber.setAttribute("aria-valuetext", text);
    this.find(".clock").textContent = `${text} of ${last.toFixed(1)} s`;
    this.names.forEach((name, i) => {
      const { time, pose, force } = this.drive.policies[name], { car } = this.drive;
      const at = (times, columns) => columns.map((values) => interpolate(times, values, this.time));
      this.stages[i].move(at(time, pose), at(car.time, car.force), at(time, force));
    });
    this.charts.mark(this.time);
    this.draw();
    this.onSeek?.(this.time);
  }

  draw() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      for (const { stage } of this.stages) stage.render();
      this.drawMap();
    });
  }

  toggle(play = !this.playing) {
    if (play === this.playing) return;
    this.playing = play;
    const button = this.find(".play");
    button.textContent = play ? "❚❚" : "▶";
    button.setAttribute("aria-label", play ? "Pause" : "Play");
    button.title = play ? "Pause" : "Play";
    if (!play) return;
    const [first, last] = this.drive.duration;
    if (this.time >= last - 0.01) this.seek(first);
    let before = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      // A page that was hidden goes on where it was.
      const passed = Math.min((now - before) / 1000, 0.25) * this.speed;
      before = now;
      const end = this.drive.duration[1];
      this.seek(this.time + passed);
      if (this.time >= end && !this.loop) this.toggle(false);
      else {
        if (this.time >= end) this.seek(this.drive.duration[0]);
        requestAnimationFrame(tick);
      }
    };
    requestAnimationFrame(tick);
  }

  key(event) {
    const { target } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || !this.drive) return;
    const typing = target.matches?.("select, textarea, input:not(.scrubber)");
    if (typing) return;
    const [first, last] = this.drive.duration, step = event.shiftKey ? 1 : FRAME;
    const jobs = {
      ArrowRight: () => this.seek(this.time + step),
      ArrowLeft: () => this.seek(this.time - step),
      Home: () => this.seek(first),
      End: () => this.seek(last),
      c: () => this.view(this.mode === "driver" ? "outside" : "driver"),
      "+": () => this.stages[0].stage.zoom(0.85),
      "-": () => this.stages[0].stage.zoom(1 / 0.85),
      a: () => this.stages[0].stage.turn(-0.12, 0),
      d: () => this.stages[0].stage.turn(0.12, 0),
      w: () => this.stages[0].stage.turn(0, 0.08),
      s: () => this.stages[0].stage.turn(0, -0.08),
    };
    if (!target.matches?.("button, a, summary")) jobs[" "] = () => this.toggle();
    const job = jobs[event.key];
    if (!job) return;
    event.preventDefault();
    if (event.key.startsWith("Arrow") || event.key === "Home" || event.key === "End") this.toggle(false);
    job();
  }

  /* ---- the road ---- */

  drawMap() {
    const { map } = this, road = this.drive?.road;
    if (!road || map.hidden) return;
    const ratio = Math.min(devicePixelRatio, 2), { clientWidth: width, clientHeight: height } = map;
    if (!width) return;
    if (map.width !== Math.round(width * ratio)) { map.width = Math.round(width * ratio); map.height = Math.round(height * ratio); }
    const context = map.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const here = ["x", "y", "heading"].map((name) => interpolate(road.time, road[name], this.time));
    const scale = width / 110, at = (k) => [
      width * 0.42 + scale * (road.x[k] - here[0]), height * 0.5 + scale * (road.y[k] - here[1])];
    const trace = (begin, end, style, wide) => {
      context.beginPath();
      for (let k = begin; k <= end; k++) {
        const [x, y] = at(k);
        if (k === begin) context.moveTo(x, y); else context.lineTo(x, y);
      }
      Object.assign(context, { strokeStyle: style, lineWidth: wide, lineJoin: "round", lineCap: "round" });
      context.stroke();
    };
    const now = indexAt(road.time, this.time), last = road.time.length - 1;
    trace(0, last, "#c9d1da", 7 * scale);
    trace(0, last, "#ffffff", 1);
    if (now > 0) trace(0, now, "#00619a", 2);
    context.translate(width * 0.42, height * 0.5);
    context.rotate(here[2]);
    const long = Math.max(4.6 * scale, 13), wide = 0.42 * long;
    context.fillStyle = CAR_COLOR;
    context.beginPath();
    context.roundRect(-0.5 * long, -0.5 * wide, long, wide, 0.3 * wide);
    context.fill();
    context.fillStyle = "#9fb4c6";
    context.fillRect(0.1 * long, -0.36 * wide, 0.16 * long, 0.72 * wide);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = "#3d4753";
    context.font = CHART_FONT;
    context.fillRect(8, height - 10, 20 * scale, 2);
    context.fillText("20 m", 14 + 20 * scale, height - 6);
  }
}
