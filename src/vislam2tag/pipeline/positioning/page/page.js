"use strict";
const part = (id) => document.getElementById(id);
const MARGIN_M = 10;
let model = null;
let shown = "";

function element(name, attributes) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

// y points up on plans and down on screens.
function draw(positions) {
  const floor = model.floors[part("floor").selectedIndex];
  const here = positions.filter((one) => one.status !== "unknown" && one.floor === floor.floor
    && (one.building ?? "") === floor.building);
  const map = part("map");
  map.replaceChildren();
  let box = null;
  if (floor.plan) {
    const [x, y] = floor.lower_left_m;
    box = [x, -y - floor.height_m, floor.width_m, floor.height_m];
    map.append(element("image", { href: floor.plan, x: box[0], y: box[1], width: box[2], height: box[3],
      preserveAspectRatio: "none" }));
  } else if (here.length) {
    const xs = here.map((one) => one.x), ys = here.map((one) => -one.y);
    const reach = MARGIN_M + Math.max(...here.map((one) => one.radius_95_m));
    const left = Math.min(...xs) - reach, top = Math.min(...ys) - reach;
    box = [left, top, Math.max(...xs) + reach - left, Math.max(...ys) + reach - top];
  }
  if (!box) return;
  map.setAttribute("viewBox", box.join(" "));
  const dot = Math.max(box[2], box[3]) / 150;
  const last = here[here.length - 1];
  for (const one of here.slice(0, -1)) map.append(element("circle", { class: "before", cx: one.x, cy: -one.y, r: dot / 2 }));
  if (last) {
    map.append(element("circle", { class: "outer", cx: last.x, cy: -last.y, r: last.radius_95_m }));
    map.append(element("circle", { class: "inner", cx: last.x, cy: -last.y, r: last.radius_68_m }));
    map.append(element("circle", { class: "here", cx: last.x, cy: -last.y, r: dot }));
  }
}

function report(positions) {
  const last = positions[positions.length - 1];
  if (!last) return;
  if (last.status === "unknown") {
    part("said").textContent = `${last.scan_id}: unknown, because the scan contains none of the model's access points`;
    return;
  }
  const index = model.floors.findIndex((one) => one.floor === last.floor && one.building === (last.building ?? ""));
  if (JSON.stringify(last) !== shown) part("floor").selectedIndex = index;
  shown = JSON.stringify(last);
  part("said").textContent = `${last.scan_id}: ${last.building ?? ""} ${last.floor_name ?? ""} floor ${last.floor}, ${last.room ? last.room + ", " : ""}x ${last.x.toFixed(1)} m, `
    + `y ${last.y.toFixed(1)} m; radius ${last.radius_68_m.toFixed(1)} m (68 %), `
    + `${last.radius_95_m.toFixed(1)} m (95 %)`
    + (last.status === "unlike" ? ". The scan is unlike all training data: do not rely on this position" : "");
}

async function refresh() {
  const answer = await fetch("latest");
  const positions = (await answer.json()).positions;
  report(positions);
  draw(positions);
}

async function locate() {
  const readings = {};
  for (const line of part("scan").value.split("\n")) {
    const [address, level] = line.split(/[,\s]+/).filter((word) => word);
    if (address) readings[address] = Number(level);
  }
  const answer = await fetch("locate", { method: "POST", headers: { "Content-Type": "application/json" },
    body: JSON.stringify({ scans: [{ scan_id: "page", readings }] }) });
  const found = await answer.json();
  if (!answer.ok) part("said").textContent = found.message;
  else {
    await refresh();
    part("notes").textContent = found.notes.join(" ");
  }
}

async function start() {
  model = await (await fetch("model")).json();
  part("model").textContent = `${model.model}, learned from ${model.scans} scans of ${model.dataset}, `
    + `${model.access_points} access points`;
  for (const one of model.floors) part("floor").append(new Option(`${one.building} ${one.name} ${one.floor}`.replace(/ +/g, " ").trim()));
  part("floor").addEventListener("change", refresh);
  part("locate").addEventListener("click", locate);
  await refresh();
  setInterval(refresh, 1000);
}

start();
