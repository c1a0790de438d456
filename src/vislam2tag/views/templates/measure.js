"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const by = (id) => document.getElementById(id);
const [left, right, low, high] = data.box, [columns, rows] = data.size;
const svg = by("plan");
const clicked = {distance: [], area: []};  // points in the plan's own coordinates
let zoom = 1;
svg.setAttribute("viewBox", `0 0 ${columns} ${rows}`);
by("picture").setAttribute("width", columns);
by("picture").setAttribute("height", rows);
by("area-choice").hidden = !data.picture;
const digits = Math.max(0, 2 - Math.floor(Math.log10((right - left) / columns)) - 1);
const round = (value) => Number(value.toFixed(Math.min(digits, 9)));
const toPlan = (px, py) => [round(left + (right - left) * px / columns),
  round(data.downwards ? low + (high - low) * py / rows : high - (high - low) * py / rows)];
const toPixel = ([x, y]) => [(x - left) / (right - left) * columns,
  (data.downwards ? y - low : high - y) / (high - low) * rows];

function metres() {
  const typed = Number(by("metres").value.trim().replace(",", "."));
  return typed > 0 && Number.isFinite(typed) ? typed : null;
}

function draw() {
  const size = Math.max(columns, rows) / 150 / zoom, marks = [];
  const add = (name, attributes) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries({fill: "none", stroke: "#d55e00", "stroke-width": size / 4, ...attributes})) made.setAttribute(key, value);
    marks.push(made);
  };
  const [a, b] = clicked.distance.map(toPixel), [c, d] = clicked.area.map(toPixel);
  for (const point of [a, b, c, d]) if (point) add("circle", {cx: point[0], cy: point[1], r: size});
  if (b) add("line", {x1: a[0], y1: a[1], x2: b[0], y2: b[1]});
  if (d) add("rect", {x: Math.min(c[0], d[0]), y: Math.min(c[1], d[1]), width: Math.abs(c[0] - d[0]), height: Math.abs(c[1] - d[1]), stroke: "#0550ae"});
  by("marks").replaceChildren(...marks);
  const area = clicked.area.length === 2 ? clicked.area.flat() : null, options = [], entries = [];
  if (area) { options.push(`--area ${area.join(",")}`); entries.push(`area = [${area.join(", ")}]`); }
  const whole = clicked.distance.length === 2 && metres() !== null;
  if (whole) {
    const [p, q] = clicked.distance;
    options.push(`--distance ${[...p, ...q, metres()].join(",")}`);
    entries.push(`distance = { from = [${p.join(", ")}], to = [${q.join(", ")}], metres = ${metres()} }`);
  }
  by("command").textContent = whole ? [data.command, ...options].join(" ") : "";
  by("toml").textContent = whole ? entries.join("\n") : "";
  by("state").textContent = clicked.distance.length < 2 ? `Points left to click: ${2 - clicked.distance.length}`
    : metres() === null ? "Now type the distance" : "";
}

svg.addEventListener("click", (event) => {
  const box = svg.getBoundingClientRect();
  const points = clicked[by("area").checked ? "area" : "distance"];
  if (points.length === 2) points.length = 0;
  points.push(toPlan((event.clientX - box.left) / box.width * columns, (event.clientY - box.top) / box.height * rows));
  if (clicked.area.length === 2) by("area").checked = false;
  draw();
});
by("metres").addEventListener("input", draw);
function resize(factor) { zoom = Math.min(Math.max(zoom * factor, 1), 20); svg.style.width = `${100 * zoom}%`; draw(); }
by("larger").addEventListener("click", () => resize(1.5));
by("smaller").addEventListener("click", () => resize(1 / 1.5));
draw();
