"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const [left, right, low, high] = data.extent_m;
const planPixel = [(right - left) / data.columns, (high - low) / data.rows];
const by = (id) => document.getElementById(id);
const svg = by("plan"), field = by("id");
const clicks = new Map();  // id -> {x, y, pixel}: metres in the building, metres of a screen pixel at the time
let view = {scale: 1, x: 0, y: 0};  // screen pixels of a metre, and its position (left, high) on the screen
let chosen = null, held = null, saved = true;
const MOVED = 4;  // pixels: less is a click, not a drag

const toScreen = (x, y) => [view.x + (x - left) * view.scale, view.y + (high - y) * view.scale];
const toPlan = (sx, sy) => [left + (sx - view.x) / view.scale, high - (sy - view.y) / view.scale];
const inside = (x, y) => x >= left && x <= right && y >= low && y <= high;

function whole() {
  const box = svg.getBoundingClientRect();
  view.scale = 0.96 * Math.min(box.width / (right - left), box.height / (high - low));
  view.x = (box.width - view.scale * (right - left)) / 2;
  view.y = (box.height - view.scale * (high - low)) / 2;
  draw();
}

function zoom(factor, sx, sy) {
  const limit = Math.min(Math.max(view.scale * factor, 1), 5000);
  const by = limit / view.scale;
  view = {scale: limit, x: sx - by * (sx - view.x), y: sy - by * (sy - view.y)};
  draw();
}

function element(name, attributes, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

function draw() {
  const picture = by("picture");
  picture.setAttribute("width", (right - left) * view.scale);
  picture.setAttribute("height", (high - low) * view.scale);
  by("world").setAttribute("transform", `translate(${view.x} ${view.y})`);
  by("expected").replaceChildren(...Object.entries(data.expected).filter(([id]) => !clicks.has(id)).map(([id, [x, y]]) => {
    const mark = element("g", {class: "expected", transform: `translate(${toScreen(x, y).join(" ")})`});
    mark.append(element("circle", {r: 7}), element("text", {x: 9, y: 4}, id));
    mark.style.pointerEvents = "none";
    return mark;
  }));
  by("marks").replaceChildren(...[...clicks].map(([id, click]) => {
    const mark = element("g", {class: id === chosen ? "mark chosen" : "mark", "data-id": id,
      transform: `translate(${toScreen(click.x, click.y).join(" ")})`});
    mark.append(element("circle", {r: 9}), element("line", {x1: -5, x2: 5}), element("line", {y1: -5, y2: 5}),
      element("text", {x: 12, y: -6}, id));
    return mark;
  }));
  const body = by("list").tBodies[0];
  body.replaceChildren(...[...clicks].map(([id, click]) => {
    const row = document.createElement("tr");
    row.className = id === chosen ? "chosen" : "";
    for (const [text, number] of [[id, false], [click.x.toFixed(2), true], [click.y.toFixed(2), true]]) {
      const cell = document.createElement("td");
      cell.textContent = text;
      if (number) cell.className = "num";
      row.append(cell);
    }
    row.addEventListener("click", () => { chosen = id; field.value = id; draw(); });
    return row;
  }));
  const missing = data.ids.filter((id) => !clicks.has(id)).length;
  by("state").textContent = `${clicks.size} placed` + (data.ids.length ? `, ${missing} of the site's landmarks left` : "")
    + `; one pixel of the screen is ${(100 / view.scale).toFixed(1)} cm`;
}

function put(id, x, y) {
  clicks.set(id, {x, y, pixel: 1 / view.scale});
  chosen = id;
  saved = false;
}

function nextId(id) {
  const left_over = data.ids.find((other) => !clicks.has(other));
  if (data.ids.length) return left_over ?? "";
  const match = /^(.*?)(\d+)$/.exec(id);
  return match ? match[1] + String(Number(match[2]) + 1) : "";
}

function place(sx, sy) {
  const id = field.value.trim(), [x, y] = toPlan(sx, sy);
  if (!id || /[",;]/.test(id)) { by("state").textContent = "Enter the landmark's id first (no commas)"; field.focus(); return; }
  if (!inside(x, y)) { by("state").textContent = "This position is outside the plan"; return; }
  put(id, x, y);
  field.value = nextId(id);
  draw();
}

function remove() {
  if (chosen === null || !clicks.delete(chosen)) return;
  field.value = chosen;
  chosen = null;
  saved = false;
  draw();
}

function csv() {
  const rows = [...clicks].map(([id, click]) => [id, data.floor, click.x.toFixed(4), click.y.toFixed(4),
    click.pixel.toPrecision(4), Math.max(...planPixel).toPrecision(4)].join(","));
  return [data.header, ...rows].join("\n") + "\n";
}

function save() {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([csv()], {type: "text/csv"}));
  link.download = `clicks_floor_${data.floor}.csv`;
  link.click();
  saved = true;
}

const at = (event) => { const box = svg.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
svg.addEventListener("pointerdown", (event) => {
  const mark = event.target.closest(".mark"), [sx, sy] = at(event);
  held = {id: mark ? mark.dataset.id : null, sx, sy, last: [sx, sy], moved: false};
  if (mark) { chosen = held.id; field.value = held.id; draw(); }
  svg.setPointerCapture(event.pointerId);
});
svg.addEventListener("pointermove", (event) => {
  if (!held) return;
  const [sx, sy] = at(event);
  held.moved ||= Math.hypot(sx - held.sx, sy - held.sy) > MOVED;
  if (!held.moved) return;
  const [dx, dy] = [sx - held.last[0], sy - held.last[1]];
  held.last = [sx, sy];
  if (held.id === null) { view.x += dx; view.y += dy; } else {
    const [x, y] = toPlan(sx, sy);
    if (inside(x, y)) put(held.id, x, y);
  }
  draw();
});
svg.addEventListener("pointerup", (event) => {
  if (held && !held.moved && held.id === null) place(...at(event));
  held = null;
});
svg.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(-event.deltaY / 400), ...at(event)); }, {passive: false});
svg.addEventListener("keydown", (event) => {
  const step = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
  if (event.key === "Delete" || event.key === "Backspace") remove();
  if (!step || chosen === null || !clicks.has(chosen)) return;
  event.preventDefault();
  const {x, y} = clicks.get(chosen);
  const [nx, ny] = [x + step[0] / view.scale, y + step[1] / view.scale];
  if (inside(nx, ny)) put(chosen, nx, ny);
  draw();
});
const middle = () => { const box = svg.getBoundingClientRect(); return [box.width / 2, box.height / 2]; };
by("zoom-in").addEventListener("click", () => zoom(1.5, ...middle()));
by("zoom-out").addEventListener("click", () => zoom(1 / 1.5, ...middle()));
by("whole").addEventListener("click", whole);
by("remove").addEventListener("click", remove);
by("save").addEventListener("click", save);
addEventListener("resize", draw);
addEventListener("beforeunload", (event) => { if (!saved) event.preventDefault(); });
by("ids").replaceChildren(...data.ids.map((id) => { const option = document.createElement("option"); option.value = id; return option; }));
field.value = data.ids[0] ?? "1";
whole();
