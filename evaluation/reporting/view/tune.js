"use strict";
/* Sliders of a washout, and the drive replayed by the server at each change. */
(async () => {
  const byId = (id) => document.getElementById(id);
  const about = JSON.parse(byId("about").textContent);
  const scene = JSON.parse(new TextDecoder().decode(await inflated(byId("scene").textContent.trim())));
  const film = new Film(document.querySelector(".film"), scene, (name) => about.styles[name]);
  film.loop = true;
  const places = Object.fromEntries(about.sliders.map(({ path, place }) => [path, place]));
  const element = (tag, fields = {}, ...children) => {
    const one = Object.assign(document.createElement(tag), fields);
    one.append(...children);
    return one;
  };
  const value = ({ low, high, log }, place) => (log ? low * (high / low) ** place : low + (high - low) * place);
  const digits = (x) => `${+x.toPrecision(3)}`;

  async function ask(path, data) {
    const answer = await fetch(path, {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(data),
    });
    const content = await answer.json();
    if (content.error) throw new Error(content.error);
    return content;
  }

  function complain(error) {
    byId("trouble").hidden = !error;
    byId("trouble").textContent = error ? error.message : "";
  }

  /* ---- sliders ---- */

  const inputs = [];
  const groups = new Map();
  for (const one of about.sliders) {
    if (!groups.has(one.kind)) {
      const title = one.kind.replaceAll(".", ", ").replaceAll("_", " ");
      const box = element("fieldset", { className: "kind" }, element("legend", {}, title));
      if (one.effect) box.append(element("p", { className: "effect" }, element("b", {}, "Raise it, and "), `${one.effect}.`));
      groups.set(one.kind, box);
      byId("sliders").append(box);
    }
    const input = element("input", { type: "range", min: 0, max: 1, step: 0.005, value: one.place });
    const output = element("output");
    const label = element("label", { className: "slider" }, element("span", {}, one.axis || "all"), input, output);
    input.setAttribute("aria-label", `${one.kind} ${one.axis}`.trim());
    const write = () => {
      output.textContent = `${digits(value(one, places[one.path]))}${one.unit ? ` ${one.unit}` : ""}`;
      input.setAttribute("aria-valuetext", output.textContent);
      label.classList.toggle("changed", Math.abs(places[one.path] - one.place) > 1e-9);
    };
    input.addEventListener("input", () => {
      places[one.path] = +input.value;
      write();
      replay();
    });
    write();
    inputs.push({ one, input, write });
    groups.get(one.kind).append(label);
  }

  /* ---- the drive ---- */

  let busy = false, again = false, turn = 0;

  async function replay() {
    // While one is driven the newest waits; those between are left out.
    if (busy) { again = true; return; }
    busy = true;
    const began = performance.now();
    try {
      const answer = await ask("/replay", { drive: byId("drive").value, places });
      const drive = await unpackDrive(answer.drive, about.missing);
      film.show(drive, about.names);
      figures(answer.figures);
      window.motionCueingTune = { film, answer, places, turn: ++turn };
      byId("took").textContent = `Driven again in ${Math.round(1000 * answer.seconds)} ms, shown after ${Math.round(performance.now() - began)} ms.`;
      complain(null);
    } catch (error) {
      complain(error);
    }
    busy = false;
    if (again) { again = false; replay(); }
  }

  function figures(found) {
    const [start, now] = about.names, names = Object.keys(found[now]);
    const show = (name, x) => (x === null ? "–" : /travel|limit/.test(name) ? `${(100 * x).toFixed(1)} %` : Charts.number(x));
    document.querySelector("#figures thead").replaceChildren(
      element("tr", {}, element("td"), ...names.map((name) => element("th", { scope: "col" }, name))));
    document.querySelector("#figures tbody").replaceChildren(...[now, start].map((row) => element("tr", {
      className: row === now ? "best" : "" }, element("th", { scope: "row" }, row),
    ...names.map((name) => element("td", {}, show(name, found[row][name]))))));
  }

  byId("drive").append(...about.drives.map((name) => element("option", { value: name }, name)));
  byId("drive").addEventListener("change", replay);
  byId("start").addEventListener("click", () => {
    for (const { one, input, write } of inputs) {
      places[one.path] = one.place;
      input.value = one.place;
      write();
    }
    replay();
  });
  byId("save").textContent = `Save ${about.out}`;
  byId("save").addEventListener("click", async () => {
    try {
      byId("saved").textContent = `${(await ask("/save", { places })).saved} is written.`;
      complain(null);
    } catch (error) {
      complain(error);
    }
  });
  await replay();
  window.ready = true;
})();
