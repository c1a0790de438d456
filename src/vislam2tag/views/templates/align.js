"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const by = (id) => document.getElementById(id);
const svg = by("plan"), [floor, onto] = data.floors;
const clicked = [];  // metres: on the floor, on the other one, and again
let zoom = 1;

// Complex numbers are points: the floor lies on the other one by turn * point + shift.
const times = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];
const plus = ([a, b], [c, d]) => [a + c, b + d];
const minus = ([a, b], [c, d]) => [a - c, b - d];
const over = (p, [c, d]) => times(p, [c / (c * c + d * d), -d / (c * c + d * d)]);

function placement() {
  if (clicked.length < 4) return [data.turn, data.shift];
  const [p, q, r, s] = clicked, turn = over(minus(s, q), minus(r, p)), size = Math.hypot(...turn);
  const unit = turn.map((value) => value / size), middle = (one, other) => plus(one, other).map((value) => value / 2);
  return [unit, minus(middle(q, s), times(unit, middle(p, r)))];
}

function place(image, {extent_m: [left, right, low, high], image: href}) {
  for (const [key, value] of Object.entries({href, x: left, y: -high, width: right - left, height: high - low})) image.setAttribute(key, value);
}

function box() {
  const [turn, shift] = [data.turn, data.shift], [left, right, low, high] = floor.extent_m, [a, b, c, d] = onto.extent_m;
  const corners = [[left, low], [right, low], [left, high], [right, high]].map((corner) => plus(times(turn, corner), shift));
  const x = [a, b, ...corners.map((corner) => corner[0])], y = [c, d, ...corners.map((corner) => corner[1])];
  return [Math.min(...x), -Math.max(...y), Math.max(...x) - Math.min(...x), Math.max(...y) - Math.min(...y)];
}

function draw() {
  const [turn, shift] = placement(), next = clicked.length % 2, done = clicked.length === 4;
  // y points down on the screen: the turn is mirrored
  by("moved").setAttribute("transform", `matrix(${turn[0]} ${-turn[1]} ${turn[1]} ${turn[0]} ${shift[0]} ${-shift[1]})`);
  by("floor").setAttribute("opacity", done ? 0.6 : next ? 0.15 : 1);
  by("onto").setAttribute("opacity", done ? 0.6 : next ? 1 : 0.15);
  const size = Math.max(...box().slice(2)) / 120 / zoom;
  by("marks").replaceChildren(...clicked.map((point, place) => {
    const [x, y] = place % 2 ? point : plus(times(turn, point), shift);
    const mark = document.createElementNS("http://www.w3.org/2000/svg", "circle");
    for (const [key, value] of Object.entries({cx: x, cy: -y, r: size, fill: "none", stroke: place % 2 ? "#0550ae" : "#d55e00", "stroke-width": size / 4})) mark.setAttribute(key, value);
    return mark;
  }));
  const pair = (place) => `--pair=${clicked[place].map((value) => value.toFixed(2))}=${clicked[place + 1].map((value) => value.toFixed(2))}`;
  by("command").textContent = done ? [data.command, pair(0), pair(2)].join(" ") : "";
  by("state").textContent = done ? "Check that the walls of both floors fit" : `Click ${clicked.length < 2 ? "a place" : "a second place"} on ${data.floors[next].name}`;
}

svg.addEventListener("click", (event) => {
  if (clicked.length === 4) clicked.length = 0;
  const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(by("world").getScreenCTM().inverse());
  const point = [at.x, -at.y];
  clicked.push(clicked.length % 2 ? point : over(minus(point, data.shift), data.turn));
  draw();
});
function resize(factor) { zoom = Math.min(Math.max(zoom * factor, 1), 20); svg.style.width = `${100 * zoom}%`; draw(); }
by("larger").addEventListener("click", () => resize(1.5));
by("smaller").addEventListener("click", () => resize(1 / 1.5));
place(by("floor"), floor);
place(by("onto"), onto);
svg.setAttribute("viewBox", box().join(" "));
draw();
