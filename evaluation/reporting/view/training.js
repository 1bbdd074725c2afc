"use strict";
/* A training that goes on: its log every other second, and a film of its best agent when there is another. */
(async () => {
  const byId = (id) => document.getElementById(id);
  const about = JSON.parse(byId("about").textContent);
  const scene = JSON.parse(new TextDecoder().decode(await inflated(byId("scene").textContent.trim())));
  const root = document.querySelector(".film");
  const EVERY = 2000;
  let film = null, agent = 0, titles = "", charts = null, before = "";
  root.hidden = true;

  async function ask(path) {
    const content = await (await fetch(path)).json();
    if (content.error) throw new Error(content.error);
    return content;
  }

  function plot(plots) {
    const found = plots.map(({ title, log }) => `${title}${log}`).join();
    if (found !== titles) {
      titles = found;
      const holder = document.createElement("div");
      holder.className = "charts";
      byId("log").replaceChildren(holder);
      charts = new Charts(holder, plots.map(({ title, log }) => ({ title, log, unit: "" })), null, true);
    }
    charts.show(plots.flatMap(({ lines }, p) => lines.map(({ values, ...line }) => {
      const columns = [];
      columns[p] = values;
      return { ...line, values: columns };
    })));
    charts.panels.forEach((panel, p) => {
      panel.values.replaceChildren();
      const keys = plots[p].lines.map((line) => {
        const key = document.createElement("span"), sample = document.createElement("i");
        sample.style.borderTop = `3px ${line.dash.length ? "dashed" : "solid"} ${line.color}`;
        key.append(sample, `${line.label} ${Charts.number(line.values[line.values.length - 1])}`);
        return key;
      });
      panel.legend ||= panel.figure.appendChild(Object.assign(document.createElement("div"), { className: "legend" }));
      panel.legend.replaceChildren(...keys);
    });
  }

  async function show() {
    const { drive, agent: version } = await ask("/film");
    if (!drive) return;
    root.hidden = false;
    film ||= new Film(root, scene, (name) => about.styles[name]);
    film.loop = true;
    film.show(await unpackDrive(drive, about.missing), about.names);
    byId("film-state").textContent = `The agent of ${new Date(version).toLocaleTimeString()}.`;
    agent = version;
  }

  async function look() {
    try {
      const found = await ask("/log"), text = JSON.stringify(found.plots);
      byId("state").textContent = found.plots.length
        ? `${(found.steps / 1e6).toPrecision(4)} million actions. The plots are over million actions.` : "The log is empty yet.";
      if (text !== before && found.plots.length) { before = text; plot(found.plots); }
      if (found.agent && found.agent !== agent) {
        // An agent that cannot drive here is not tried again; the plots go on.
        agent = found.agent;
        await show().catch((error) => { byId("film-state").textContent = error.message; });
      }
      byId("trouble").hidden = true;
      window.motionCueingTraining = { found, film, charts, agent };
      window.ready = true;
    } catch (error) {
      byId("trouble").textContent = error.message;
      byId("trouble").hidden = false;
    }
    setTimeout(look, EVERY);
  }
  await look();
})();
