"use strict";
/* The page of a view: which drive and which policies are shown. */
(async () => {
  const byId = (id) => document.getElementById(id);
  const about = JSON.parse(byId("about").textContent);
  const sources = [...document.querySelectorAll("script.packed")];
  const complain = (text) => {
    byId("trouble").textContent = text;
    byId("trouble").hidden = false;
  };
  if (typeof DecompressionStream === "undefined") return complain("This page needs a browser of 2023 or newer.");
  const scene = JSON.parse(new TextDecoder().decode(await inflated(byId("scene").textContent.trim())));
  let film;
  try {
    film = new Film(document.querySelector(".film"), scene, (name) => about.styles[name]);
  } catch (error) {
    return complain(`The machine cannot be drawn: ${error.message}`);
  }
  const unpacked = new Map();
  const load = (index) => {
    if (!unpacked.has(index)) unpacked.set(index, unpackDrive(JSON.parse(sources[index].textContent), about.missing));
    return unpacked.get(index);
  };
  const option = (value, text = value) => Object.assign(document.createElement("option"), { value, textContent: text });
  const [drives, left, right] = ["drive", "left", "right"].map(byId);
  drives.append(...about.drives.map((name) => option(name)));
  byId("drives").hidden = about.drives.length < 2;
  const address = new URLSearchParams(location.hash.slice(1));
  if (about.drives.includes(address.get("drive"))) drives.value = address.get("drive");
  // What a person chose; a drive without one of them shows the others.
  let chosen = address.getAll("policy");

  async function show() {
    const index = Math.max(about.drives.indexOf(drives.value), 0), drive = await load(index);
    const names = about.policies.filter((name) => name in drive.policies);
    let shown = chosen.filter((name) => names.includes(name)).slice(0, 2);
    if (!shown.length) shown = names.slice(0, 2);
    left.replaceChildren(...names.map((name) => option(name)));
    right.replaceChildren(option("", "nothing"), ...names.filter((name) => name !== shown[0]).map((name) => option(name)));
    [left.value, right.value] = [shown[0], shown[1] || ""];
    byId("others").hidden = names.length < 2;
    try {
      film.show(drive, shown);
    } catch (error) {
      return complain(`The machine cannot be drawn: ${error.message}`);
    }
    const fields = new URLSearchParams({ drive: about.drives[index] });
    for (const name of shown) fields.append("policy", name);
    history.replaceState(null, "", `#${fields}`);
    window.motionCueingView = { film, about, ready: index };
  }

  const choose = () => {
    chosen = [left.value, ...(right.value && right.value !== left.value ? [right.value] : [])];
    return show();
  };
  drives.addEventListener("change", show);
  left.addEventListener("change", choose);
  right.addEventListener("change", choose);
  addEventListener("hashchange", () => {
    const fields = new URLSearchParams(location.hash.slice(1));
    if (about.drives.includes(fields.get("drive"))) drives.value = fields.get("drive");
    chosen = fields.getAll("policy");
    show();
  });
  byId("choice").addEventListener("submit", (event) => event.preventDefault());
  await show();
})();
