"use strict";
/* The plots of the report: drives are unpacked in the browser and drawn by uPlot, all over one time axis.

   uPlot draws, for every column of pixels, the lowest and the highest of all samples in it. So no extreme is
   lost at any zoom, and no sample is dropped before it is drawn. */
(() => {
  const byId = (id) => document.getElementById(id);
  const about = JSON.parse(byId("about").textContent);
  const sources = [...document.querySelectorAll("script.packed")];
  const SOFT = "#566070", GRID = "#e9edf1", CAR = "#1a1a1a", LIMIT = "#a61e1e";
  const FONT = '12px system-ui, "Segoe UI", Roboto, Helvetica, Arial, sans-serif';
  const GRAVITY = 9.81, SHORTEST = 0.05;

  /* ---- tables ---- */

  const value = (cell) => {
    const text = cell.textContent.trim().replace("−", "-");
    const number = parseFloat(text);
    return Number.isNaN(number) ? null : number;
  };

  function sort(table, column, header) {
    const rising = header.getAttribute("aria-sort") !== "ascending";
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    header.setAttribute("aria-sort", rising ? "ascending" : "descending");
    const body = table.tBodies[0], sign = rising ? 1 : -1;
    const keyed = [...body.rows].map((row) => {
      const cell = row.cells[column];
      return { row, number: column ? value(cell) : null, text: cell.textContent };
    });
    const numeric = keyed.some((one) => one.number !== null);
    keyed.sort((a, b) => {
      if (!numeric) return sign * a.text.localeCompare(b.text);
      // What is undefined comes last in either direction.
      if (a.number === null || b.number === null) return (a.number === null) - (b.number === null);
      return sign * (a.number - b.number);
    });
    body.append(...keyed.map((one) => one.row));
  }

  for (const table of document.querySelectorAll("table.sortable")) {
    [...table.tHead.rows[0].cells].forEach((header, column) => {
      if (header.tagName !== "TH") return;
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = header.textContent;
      header.replaceChildren(button);
      button.addEventListener("click", () => sort(table, column, header));
    });
  }

  if (!sources.length) return;

  /* ---- packed drives ---- */

  async function unpack(content) {
    const arrays = await unpackArrays(content, about.missing);
    const of = ({ time, panels }) => ({
      time: arrays[time],
      panels: Object.fromEntries(Object.entries(panels).map(([name, list]) => [name, list.map((i) => arrays[i])])),
    });
    const policies = {};
    for (const [name, one] of Object.entries(content.policies)) policies[name] = { ...one, ...of(one) };
    return { ...content, data: null, car: of(content.car), policies };
  }

  const unpacked = new Map();
  const load = (index) => {
    if (!unpacked.has(index)) unpacked.set(index, unpack(JSON.parse(sources[index].textContent)));
    return unpacked.get(index);
  };

  /* ---- state ---- */

  const state = {
    index: 0, drive: null, shown: new Set(about.shown), from: 0, to: 1, moment: null, panning: false,
    charts: [], phases: [], overview: null,
  };
  window.motionCueingReport = { state, setRange, choose, about };
  const style = (name) => about.styles[name];
  const names = () => about.policies.filter((name) => name in state.drive.policies);
  const shown = () => names().filter((name) => state.shown.has(name));
  const span = () => state.drive.duration;

  function number(x) {
    if (x === null || x === undefined || Number.isNaN(x)) return "–";
    const size = Math.abs(x);
    return size >= 100 ? x.toFixed(0) : size >= 10 ? x.toFixed(1) : size >= 1 ? x.toFixed(2) : x.toFixed(3);
  }

  const element = (tag, attributes = {}, ...children) => {
    const one = document.createElement(tag);
    for (const [name, text] of Object.entries(attributes)) one.setAttribute(name, text);
    one.append(...children);
    return one;
  };

  function sample(name) {
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
    svg.setAttribute("width", "26");
    svg.setAttribute("height", "8");
    svg.setAttribute("aria-hidden", "true");
    for (const [key, text] of Object.entries({
      x1: 0, x2: 26, y1: 4, y2: 4, stroke: name === null ? CAR : style(name).color, "stroke-width": 3,
      "stroke-dasharray": name === null ? "" : style(name).dash.join(" "),
    })) line.setAttribute(key, text);
    svg.append(line);
    return svg;
  }

  /* ---- plots over time ---- */

  const axis = (side, more = {}) => ({
    stroke: SOFT, font: FONT, grid: { stroke: GRID, width: 1 }, ticks: { stroke: GRID, width: 1, size: 4 }, ...more,
    side,
  });

  function limitsOf(panel) {
    return (state.drive.limits[panel.name] || []).filter((limit) => limit !== null);
  }

  /** Limits stay in view where the motion of a shown policy comes near them. */
  function near(panel) {
    return limitsOf(panel).filter((limit) => shown().some((name) =>
      (state.drive.policies[name].panels[panel.name] || []).some((values) =>
        values.some((x) => limit > 0 ? x > 0.4 * limit : x < 0.4 * limit))));
  }

  function range(panel) {
    return (u, low, high) => {
      if (low === null || high === null || low === undefined) return panel.logarithmic ? [1, 10] : [0, panel.least];
      if (panel.logarithmic) return [low / 1.3, high * 1.3];
      for (const limit of u.near || []) [low, high] = [Math.min(low, limit), Math.max(high, limit)];
      if (panel.from_zero) low = 0;
      const lack = panel.least - (high - low);
      if (lack > 0) [low, high] = panel.from_zero ? [low, low + panel.least] : [low - lack / 2, high + lack / 2];
      const room = 0.06 * (high - low);
      return [panel.from_zero ? 0 : low - room, high + room];
    };
  }

  function drawBehind(u) {
    const { ctx, bbox } = u;
    ctx.save();
    const bar = 3 * devicePixelRatio;
    for (const [i, name] of shown().entries()) {
      const [begin, end] = state.drive.policies[name].worst;
      const left = Math.max(u.valToPos(begin, "x", true), bbox.left);
      const right = Math.min(u.valToPos(end, "x", true), bbox.left + bbox.width);
      if (right <= left) continue;
      ctx.fillStyle = style(name).color;
      ctx.globalAlpha = 0.1;
      ctx.fillRect(left, bbox.top, right - left, bbox.height);
      ctx.globalAlpha = 1;
      ctx.fillRect(left, bbox.top + (i % 6) * bar, right - left, bar);
    }
    ctx.restore();
  }

  function drawLimits(u, panel) {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.strokeStyle = LIMIT;
    ctx.lineWidth = 1.2 * devicePixelRatio;
    ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
    for (const limit of limitsOf(panel)) {
      const y = Math.round(u.valToPos(limit, "y", true));
      if (y < bbox.top || y > bbox.top + bbox.height) continue;
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
    }
    ctx.restore();
  }

  /** The lines of a panel: for each its policy (null for the car), its time and its values. */
  function lines(panel) {
    const found = [];
    const { car, policies } = state.drive;
    if (car.panels[panel.name]) found.push({ policy: null, label: "car", time: car.time, values: car.panels[panel.name][0] });
    for (const name of names()) {
      const parts = policies[name].panels[panel.name] || [];
      parts.forEach((values, k) => {
        const label = parts.length > 1 ? `${name}, ${k ? "longest" : "shortest"}` : name;
        found.push({ policy: name, label, time: policies[name].time, values, part: k, parts: parts.length });
      });
    }
    return found;
  }

  function aligned(found) {
    const time = found.length ? found[0].time : state.drive.car.time;
    if (found.every((line) => line.time === time)) return [time, ...found.map((line) => line.values)];
    return uPlot.join(found.map((line) => [line.time, line.values]));
  }

  const stepped = uPlot.paths.stepped({ align: 1 });

  function series(line, panel) {
    const car = line.policy === null;
    return {
      label: line.label, show: car || state.shown.has(line.policy), spanGaps: true,
      stroke: car ? CAR : style(line.policy).color, width: car ? 2 : 1.5,
      dash: car ? [] : style(line.policy).dash, points: { show: false }, value: (_, x) => number(x),
      ...(panel.levels ? { paths: stepped } : {}),
    };
  }

  function makeChart(panel, holder) {
    const found = lines(panel);
    const bands = [];
    found.forEach((line, i) => {
      if (line.part === 1) bands.push({ series: [i + 1, i], fill: style(line.policy).color + "22" });
    });
    const u = new uPlot({
      width: Math.max(holder.clientWidth, 200), height: 168, padding: [8, 8, 0, 0],
      scales: {
        x: { time: false, auto: false, range: () => [state.from, state.to] },
        y: { distr: panel.logarithmic ? 3 : 1, range: range(panel) },
      },
      axes: [axis(2, { size: 26, values: (_, ticks) => ticks.map((t) => `${+t.toFixed(3)}`) }),
        axis(3, { size: 50, values: (_, ticks) => ticks.map((t) => (t === null ? "" : `${+t.toPrecision(4)}`)) })],
      series: [{}, ...found.map((line) => series(line, panel))],
      bands,
      legend: { show: false },
      cursor: {
        sync: { key: "time", setSeries: false, scales: ["x", null] }, y: false,
        drag: { x: true, y: false, setScale: false }, points: { size: 6 },
        bind: {
          mousedown: (_u, _target, handler) => (event) => {
            if (event.button === 0 && (event.shiftKey || state.panning)) pan(u, event);
            else handler(event);
          },
          dblclick: () => () => setRange(...span()),
        },
      },
      hooks: {
        drawClear: [drawBehind],
        draw: [(one) => drawLimits(one, panel)],
        setSelect: [(one) => {
          if (one.select.width < 4) return;
          const left = one.posToVal(one.select.left, "x");
          const right = one.posToVal(one.select.left + one.select.width, "x");
          one.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
          setRange(left, right);
        }],
        setCursor: [(one) => { if (state.active === one) pointAt(one); }],
      },
    }, aligned(found), holder);
    Object.assign(u, { panel, found, holder, near: near(panel) });
    // The range knows what is near only now.
    u.setData(u.data);
    gestures(u);
    return u;
  }

  const touches = new Map();

  function gestures(u) {
    const over = u.over;
    over.addEventListener("pointerenter", () => { state.active = u; });
    over.addEventListener("pointerleave", () => { if (state.active === u) { state.active = null; hideTip(); } });
    over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      const t = u.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
      zoom(Math.exp(0.0025 * event.deltaY), t);
    }, { passive: false });
    over.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch") touches.set(event.pointerId, { x: event.clientX });
    });
    over.addEventListener("pointermove", (event) => {
      const one = touches.get(event.pointerId);
      if (!one) return;
      const width = over.clientWidth, length = state.to - state.from;
      const others = [...touches].filter(([id]) => id !== event.pointerId).map(([, touch]) => touch);
      if (others.length) {
        const before = Math.abs(one.x - others[0].x), after = Math.abs(event.clientX - others[0].x);
        const middle = 0.5 * (event.clientX + others[0].x) - over.getBoundingClientRect().left;
        if (before > 10 && after > 10) zoom(before / after, u.posToVal(middle, "x"));
      } else {
        shift(((one.x - event.clientX) / width) * length);
      }
      one.x = event.clientX;
    });
    for (const end of ["pointerup", "pointercancel", "pointerleave"]) {
      over.addEventListener(end, (event) => touches.delete(event.pointerId));
    }
    u.holder.addEventListener("keydown", (event) => key(u, event));
    u.holder.addEventListener("blur", hideTip);
  }

  function pan(u, event) {
    event.preventDefault();
    let x = event.clientX;
    const move = (next) => {
      shift(((x - next.clientX) / u.over.clientWidth) * (state.to - state.from));
      x = next.clientX;
    };
    const stop = () => {
      document.removeEventListener("mousemove", move);
      document.removeEventListener("mouseup", stop);
    };
    document.addEventListener("mousemove", move);
    document.addEventListener("mouseup", stop);
  }

  /* ---- range of time ---- */

  function setRange(from, to) {
    const [first, last] = span();
    const length = Math.min(Math.max(to - from, SHORTEST), last - first);
    from = Math.min(Math.max(from, first), last - length);
    [state.from, state.to] = [from, from + length];
    showRange();
    remember();
  }

  function zoom(factor, about_) {
    const middle = about_ === undefined ? 0.5 * (state.from + state.to) : about_;
    const length = Math.max((state.to - state.from) * factor, SHORTEST);
    const from = middle - ((middle - state.from) / (state.to - state.from)) * length;
    setRange(from, from + length);
  }

  const shift = (seconds) => setRange(state.from + seconds, state.to + seconds);

  function showRange() {
    for (const u of state.charts) u.setScale("x", { min: state.from, max: state.to });
    for (const u of state.phases) fillPhase(u);
    const u = state.overview;
    const left = u.valToPos(state.from, "x"), right = u.valToPos(state.to, "x");
    const [first, last] = span(), whole = state.to - state.from >= last - first;
    u.setSelect({ left, width: whole ? 0 : right - left, top: 0, height: u.over.clientHeight }, false);
    byId("from").value = state.from.toFixed(2);
    byId("to").value = state.to.toFixed(2);
  }

  /* ---- values at a moment ---- */

  const tip = byId("tip");
  const hideTip = () => { tip.hidden = true; for (const u of state.phases) u.dots.forEach((dot) => { dot.hidden = true; }); };

  function rows(u, index) {
    const rows = [];
    u.found.forEach((line, i) => {
      if (line.policy === null || state.shown.has(line.policy)) rows.push({ ...line, x: u.data[i + 1][index] });
    });
    return rows;
  }

  function pointAt(u) {
    const index = u.cursor.idx;
    if (index === null || index === undefined || u.cursor.left < 0) return hideTip();
    state.moment = u.data[0][index];
    const table = element("table");
    for (const { label, policy, x } of rows(u, index)) {
      const line = element("td", {}, sample(policy), " ", label);
      table.append(element("tr", {}, line, element("td", {}, `${number(x)} ${u.panel.unit}`.trim())));
    }
    tip.replaceChildren(element("b", {}, `${state.moment.toFixed(2)} s`), table);
    const box = u.over.getBoundingClientRect();
    placeTip(box.left + u.cursor.left, box.top + Math.max(u.cursor.top, 0));
    showDots();
    return undefined;
  }

  function placeTip(x, y) {
    tip.hidden = false;
    const left = x + 16 + tip.offsetWidth > innerWidth ? x - 16 - tip.offsetWidth : x + 16;
    tip.style.left = `${Math.max(4, left)}px`;
    tip.style.top = `${Math.max(4, Math.min(y + 14, innerHeight - tip.offsetHeight - 6))}px`;
  }

  let saying = 0;

  function say(u, index) {
    clearTimeout(saying);
    const words = rows(u, index).map(({ label, x }) => `${label} ${number(x)}`).join(", ");
    const text = `${u.data[0][index].toFixed(2)} s: ${words} ${u.panel.unit}`;
    saying = setTimeout(() => { byId("said").textContent = text; }, 200);
  }

  /** The sample of sorted times that is nearest to a moment. */
  function nearest(time, t) {
    let low = 0, high = time.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (time[middle] < t) low = middle; else high = middle;
    }
    return t - time[low] < time[high] - t ? low : high;
  }

  function key(u, event) {
    const time = u.data[0];
    const moment = state.moment === null ? state.from : Math.min(Math.max(state.moment, state.from), state.to);
    const at = nearest(time, moment), length = state.to - state.from;
    const move = (target) => {
      const index = Math.min(Math.max(target, 0), time.length - 1);
      const t = time[index];
      if (t < state.from) shift(t - state.from - 0.1 * length);
      if (t > state.to) shift(t - state.to + 0.1 * length);
      state.active = u;
      for (const one of state.charts) one.setCursor({ left: one.valToPos(t, "x"), top: 20 }, one === u);
      state.moment = t;
      say(u, index);
    };
    const second = Math.max(1, Math.round(1 / (time[1] - time[0])));
    const actions = {
      ArrowLeft: () => move(event.shiftKey ? at - second : at - 1),
      ArrowRight: () => move(event.shiftKey ? at + second : at + 1),
      Home: () => move(0), End: () => move(time.length - 1),
      "+": () => zoom(0.5, moment), "=": () => zoom(0.5, moment), "-": () => zoom(2, moment),
      PageUp: () => shift(-0.5 * length), PageDown: () => shift(0.5 * length),
      0: () => setRange(...span()), Escape: hideTip,
    };
    if (!(event.key in actions) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    actions[event.key]();
  }

  /* ---- phase plots ---- */

  function resampled(time, values, onto) {
    return time === onto ? values : Float64Array.from(onto, (t) => values[nearest(time, t)]);
  }

  function drawCurve(u, i) {
    uPlot.orient(u, i, (_series, _x, _y, scaleX, scaleY, posX, posY, offX, offY, dimX, dimY) => {
      const { ctx } = u, [xs, ys] = u.data[i], name = u.order[i - 1];
      ctx.save();
      ctx.beginPath();
      ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
      ctx.clip();
      ctx.strokeStyle = style(name).color;
      ctx.lineWidth = 1.4 * devicePixelRatio;
      ctx.setLineDash(style(name).dash.map((d) => d * devicePixelRatio));
      ctx.beginPath();
      for (let k = 0; k < xs.length; k++) {
        const x = posX(xs[k], scaleX, dimX, offX), y = posY(ys[k], scaleY, dimY, offY);
        if (k) ctx.lineTo(x, y); else ctx.moveTo(x, y);
      }
      ctx.stroke();
      ctx.restore();
    });
    return null;
  }

  function drawFullTilt(u) {
    const { ctx, bbox } = u, { min, max } = u.scales.x;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.strokeStyle = CAR;
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([2 * devicePixelRatio, 4 * devicePixelRatio]);
    ctx.beginPath();
    for (let k = 0; k <= 40; k++) {
      const f = Math.min(Math.max(min + (k / 40) * (max - min), -GRAVITY), GRAVITY);
      const tilt = (u.phase.sign * Math.asin(f / GRAVITY) * 180) / Math.PI;
      const x = u.valToPos(f, "x", true), y = u.valToPos(tilt, "y", true);
      if (k) ctx.lineTo(x, y); else ctx.moveTo(x, y);
    }
    ctx.stroke();
    ctx.restore();
  }

  const widened = (least) => (_u, low, high) => {
    if (low === null || !Number.isFinite(low) || !Number.isFinite(high)) return [-least, least];
    const lack = Math.max(0, least - (high - low)) / 2, room = 0.05 * (high - low) + lack;
    return [low - room, high + room];
  };

  function fillPhase(u) {
    const { cue, tilt } = u.phase, { car, policies } = state.drive;
    const empty = new Float64Array(0);
    const data = u.order.map((name) => {
      if (!state.shown.has(name)) return [empty, empty];
      const { time, panels } = policies[name];
      const force = resampled(car.time, car.panels[cue][0], time);
      const begin = nearest(time, state.from), end = nearest(time, state.to) + 1;
      return [force.slice(begin, end), panels[tilt][0].slice(begin, end)];
    });
    u.setData([null, ...data]);
  }

  function makePhase(phase, holder) {
    const order = names();
    const u = new uPlot({
      mode: 2, width: Math.max(holder.clientWidth, 200), height: 300, padding: [8, 8, 0, 0],
      scales: { x: { time: false, range: widened(2) }, y: { range: widened(4) } },
      axes: [axis(2, { size: 42, label: `${phase.cue} of the car, m/s²`, labelSize: 16, labelFont: FONT, labelGap: 0 }),
        axis(3, { size: 50, values: (_, ticks) => ticks.map((t) => `${+t.toPrecision(4)}`) })],
      series: [{}, ...order.map((name) => ({
        label: name, stroke: style(name).color, facets: [{ scale: "x", auto: true }, { scale: "y", auto: true }],
        paths: drawCurve, points: { show: false },
      }))],
      legend: { show: false },
      cursor: { x: false, y: false, points: { show: false }, drag: { x: false, y: false, setScale: false } },
      hooks: { drawClear: [(one) => { if (one.phase) drawFullTilt(one); }] },
    }, [null, ...order.map(() => [new Float64Array(0), new Float64Array(0)])], holder);
    const dots = order.map((name) => {
      const dot = element("div", { style: `position: absolute; width: 9px; height: 9px; margin: -4.5px; border-radius: 50%; border: 1.5px solid #fff; background: ${style(name).color}; pointer-events: none` });
      dot.hidden = true;
      u.over.append(dot);
      return dot;
    });
    Object.assign(u, { phase, order, holder, dots });
    u.over.addEventListener("pointermove", (event) => {
      const box = u.over.getBoundingClientRect();
      const x = event.clientX - box.left, y = event.clientY - box.top;
      let best = 20, found = null;
      order.forEach((name, i) => {
        const [xs, ys] = u.data[i + 1], { time } = state.drive.policies[name];
        for (let k = 0; k < xs.length; k++) {
          const distance = Math.hypot(u.valToPos(xs[k], "x") - x, u.valToPos(ys[k], "y") - y);
          if (distance < best) [best, found] = [distance, { name, t: time[nearest(time, state.from) + k], x: xs[k], y: ys[k] }];
        }
      });
      if (!found) return hideTip();
      state.moment = found.t;
      for (const one of state.charts) one.setCursor({ left: one.valToPos(found.t, "x"), top: 20 }, false);
      tip.replaceChildren(
        element("b", {}, `${found.t.toFixed(2)} s`), element("div", {}, sample(found.name), " ", found.name),
        element("div", {}, `${phase.cue} ${number(found.x)} m/s², tilt ${number(found.y)} deg`));
      placeTip(event.clientX, event.clientY);
      showDots();
      return undefined;
    });
    u.over.addEventListener("pointerleave", hideTip);
    return u;
  }

  function showDots() {
    const { car, policies } = state.drive, t = state.moment;
    for (const u of state.phases) {
      u.order.forEach((name, i) => {
        const dot = u.dots[i];
        dot.hidden = !state.shown.has(name);
        const force = car.panels[u.phase.cue][0][nearest(car.time, t)];
        const { time, panels } = policies[name];
        dot.style.left = `${u.valToPos(force, "x")}px`;
        dot.style.top = `${u.valToPos(panels[u.phase.tilt][0][nearest(time, t)], "y")}px`;
      });
    }
  }

  /* ---- the page ---- */

  function makeOverview() {
    const holder = byId("overview");
    holder.replaceChildren();
    const panel = about.panels.find((one) => one.name === "error");
    const found = lines(panel), [first, last] = span();
    state.overview = new uPlot({
      width: Math.max(holder.clientWidth, 200), height: 66, padding: [4, 20, 0, 12],
      scales: { x: { time: false, range: () => [first, last] }, y: { range: (_u, _low, high) => [0, Math.max(high || 0, 0.1)] } },
      axes: [axis(2, { size: 22, values: (_, ticks) => ticks.map((t) => `${+t.toFixed(3)} s`) }), { show: false }],
      series: [{}, ...found.map((line) => ({ ...series(line, panel), width: 1 }))],
      legend: { show: false },
      cursor: {
        x: false, y: false, points: { show: false }, drag: { x: true, y: false, setScale: false },
        bind: { dblclick: () => () => setRange(...span()) },
      },
      hooks: {
        drawClear: [drawBehind],
        setSelect: [(u) => {
          if (u.select.width < 4) showRange();
          else setRange(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
        }],
      },
    }, aligned(found), holder);
    state.overview.found = found;
  }

  function draw() {
    for (const u of [...state.charts, ...state.phases]) u.destroy();
    if (state.overview) state.overview.destroy();
    state.charts = [];
    state.phases = [];
    const groups = byId("groups");
    groups.replaceChildren();
    let name = null, grid = null;
    const pending = [];
    const figure = (title, unit, note, kind) => {
      const caption = element("figcaption", {}, element("span", {}, unit ? `${title}, ${unit}` : title));
      if (note) caption.append(element("span", { class: "limit" }, note));
      const holder = element("div", { class: "chart" });
      if (kind === "plot") Object.entries({ tabindex: "0", role: "group", "aria-label": `Plot: ${title}${unit && ", "}${unit}`, "aria-describedby": "help" })
        .forEach(([key_, text]) => holder.setAttribute(key_, text));
      else Object.entries({ role: "img", "aria-label": title }).forEach(([key_, text]) => holder.setAttribute(key_, text));
      grid.append(element("figure", { class: kind }, caption, holder));
      return holder;
    };
    const start = (title) => {
      grid = element("div", { class: "group" });
      groups.append(element("h4", {}, title), grid);
    };
    for (const panel of about.panels) {
      if (!lines(panel).some((line) => line.policy !== null)) continue;
      if (panel.group !== name) start(name = panel.group);
      const holder = figure(panel.title, panel.unit, limitText(panel), "plot");
      pending.push(() => state.charts.push(makeChart(panel, holder)));
    }
    start("Tilt against force: the dotted line is full tilt coordination");
    for (const phase of about.phases) {
      const holder = figure(phase.title, "deg", "", "plot phase");
      pending.push(() => state.phases.push(makePhase(phase, holder)));
    }
    for (const make of pending) make();
    makeOverview();
    showRange();
  }

  function limitText(panel) {
    const limits = limitsOf(panel);
    if (!limits.length) return "";
    const [low, high] = [limits[0], limits[limits.length - 1]];
    const unit = panel.unit.split(" ")[0];
    if (limits.length === 1) return `limit ${number(high)} ${unit}`;
    return low === -high ? `limit ±${number(high)} ${unit}` : `limit ${number(low)} to ${number(high)} ${unit}`;
  }

  function makeChips() {
    const box = document.querySelector(".chips.policies");
    box.replaceChildren(...names().map((name) => {
      const input = element("input", { type: "checkbox", value: name });
      input.checked = state.shown.has(name);
      input.addEventListener("change", () => {
        if (input.checked) state.shown.add(name); else state.shown.delete(name);
        showPolicies();
      });
      return element("label", {}, input, sample(name), name);
    }));
  }

  function showPolicies() {
    for (const input of document.querySelectorAll(".policies input")) input.checked = state.shown.has(input.value);
    for (const u of [...state.charts, state.overview]) {
      u.batch(() => {
        u.found.forEach((line, i) => {
          if (line.policy !== null) u.setSeries(i + 1, { show: state.shown.has(line.policy) });
        });
        if (u.panel) u.near = near(u.panel);
        u.redraw(true, true);
      });
      if (u.panel) u.setScale("x", { min: state.from, max: state.to });
    }
    for (const u of state.phases) fillPhase(u);
    hideTip();
    remember();
  }

  async function choose(index, from, to) {
    state.index = index;
    state.drive = await load(index);
    if (state.index !== index) return;
    const name = about.drives[index];
    for (const block of document.querySelectorAll(".drive")) block.hidden = block.dataset.drive !== name;
    for (const input of document.querySelectorAll(".drives input")) input.checked = +input.value === index;
    byId("plots-title").textContent = `${name}: plots`;
    byId("plots").hidden = false;
    const { stride } = state.drive, note = byId("thinned");
    note.hidden = stride < 2;
    note.textContent = `The drive is long: two points stand for the lowest and the highest of ${stride} samples.`;
    [state.from, state.to] = span();
    state.moment = null;
    makeChips();
    draw();
    if (from !== undefined) setRange(from, to);
    remember();
    window.motionCueingReport.ready = index;
  }

  let remembered = "";

  function remember() {
    const fields = new URLSearchParams({ drive: about.drives[state.index] });
    for (const name of shown()) fields.append("policy", name);
    const [first, last] = span();
    if (state.to - state.from < last - first) {
      fields.set("from", state.from.toFixed(2));
      fields.set("to", state.to.toFixed(2));
    }
    remembered = `#${fields}`;
    clearTimeout(remember.timer);
    // Browsers allow few changes of an address in a second.
    remember.timer = setTimeout(() => history.replaceState(null, "", remembered), 300);
  }

  function recall() {
    const fields = new URLSearchParams(location.hash.slice(1));
    const index = about.drives.indexOf(fields.get("drive"));
    if (index < 0) return false;
    const policies = fields.getAll("policy").filter((name) => about.policies.includes(name));
    if (policies.length) state.shown = new Set(policies);
    const [from, to] = [fields.get("from"), fields.get("to")];
    choose(index, ...(from !== null && to !== null ? [+from, +to] : []));
    return true;
  }

  function showDrive(name) {
    const index = about.drives.indexOf(name);
    if (index >= 0) choose(index);
  }

  byId("choose").hidden = false;
  document.querySelector(".chips.drives").append(...about.drives.map((name, index) => {
    const input = element("input", { type: "radio", name: "drive", value: index });
    input.addEventListener("change", () => choose(index));
    return element("label", {}, input, name);
  }));
  for (const link of document.querySelectorAll("a.to-drive")) {
    link.addEventListener("click", () => showDrive(link.dataset.drive));
  }
  document.addEventListener("click", (event) => {
    const button = event.target.closest("button.worst");
    if (!button || !(button.dataset.policy in state.drive.policies)) return;
    const [begin, end] = state.drive.policies[button.dataset.policy].worst;
    state.shown.add(button.dataset.policy);
    showPolicies();
    setRange(begin - 2, end + 2);
    byId("plots").scrollIntoView({ behavior: matchMedia("(prefers-reduced-motion)").matches ? "auto" : "smooth" });
  });
  const press = (id, action) => byId(id).addEventListener("click", action);
  press("few", () => { state.shown = new Set(about.shown); showPolicies(); });
  press("every", () => { state.shown = new Set(about.policies); showPolicies(); });
  press("earlier", () => shift(-0.5 * (state.to - state.from)));
  press("later", () => shift(0.5 * (state.to - state.from)));
  press("in", () => zoom(0.5));
  press("out", () => zoom(2));
  press("whole", () => setRange(...span()));
  press("pan", () => {
    state.panning = !state.panning;
    byId("pan").setAttribute("aria-pressed", state.panning);
    byId("groups").classList.toggle("panning", state.panning);
  });
  for (const id of ["from", "to"]) {
    byId(id).addEventListener("change", () => {
      const [from, to] = [parseFloat(byId("from").value), parseFloat(byId("to").value)];
      if (from < to) setRange(from, to); else showRange();
    });
  }
  addEventListener("hashchange", () => { if (location.hash !== remembered) recall(); });
  let resizing = 0;
  new ResizeObserver(() => {
    clearTimeout(resizing);
    resizing = setTimeout(() => {
      if (!state.overview) return;
      for (const u of [...state.charts, ...state.phases]) {
        if (u.holder.clientWidth && u.holder.clientWidth !== u.width) u.setSize({ width: u.holder.clientWidth, height: u.height });
      }
      const { clientWidth } = byId("overview");
      if (clientWidth && clientWidth !== state.overview.width) state.overview.setSize({ width: clientWidth, height: 66 });
      showRange();
    }, 100);
  }).observe(byId("groups"));
  if (typeof DecompressionStream === "undefined") {
    byId("choose").replaceChildren("The plots need a browser of 2023 or newer.");
  } else if (!recall()) choose(0);
})();
