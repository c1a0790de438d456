"use strict";
(() => {
  const REGION_95 = 2.45; // radius in sigmas (chi-squared, 2 degrees of freedom)

  // One trace a layer: the coordinates of the wanted sessions one after the other, nulls between them.
  function joined(layer, parts) {
    if (layer === "band") return band(parts);
    const x = [], y = [], hovertext = [];
    for (const part of parts) {
      const columns = part.layers[layer];
      if (!columns) continue;
      if (x.length) { x.push(null); y.push(null); hovertext.push(""); }
      x.push(...columns.x);
      y.push(...columns.y);
      columns.x.forEach((_, i) => hovertext.push(columns.hover ? columns.hover[i]
        : part.hover + (columns.sigma && columns.sigma[i] !== null ? `, sigma ${columns.sigma[i].toFixed(2)} m` : "")));
    }
    return {x, y, hovertext};
  }

  // The paths of the wanted sessions, widened to both sides by the radius of their 95 % region: a polygon a stretch.
  function band(parts) {
    const x = [], y = [];
    const stretches = parts.flatMap((part) => ["ok", "uncertain"].flatMap((layer) => stretchesOf(part.layers[layer])));
    for (const stretch of stretches) {
      const left = [], right = [];
      let across = [0, 0];
      stretch.forEach(([px, py, sigma], i) => {
        const [ax, ay] = stretch[Math.max(i - 1, 0)], [bx, by] = stretch[Math.min(i + 1, stretch.length - 1)];
        const length = Math.hypot(bx - ax, by - ay);
        if (length > 0) across = [(ay - by) / length, (bx - ax) / length];
        const radius = REGION_95 * sigma;
        left.push([px + radius * across[0], py + radius * across[1]]);
        right.unshift([px - radius * across[0], py - radius * across[1]]);
      });
      if (x.length) { x.push(null); y.push(null); }
      for (const [px, py] of [...left, ...right, left[0]]) { x.push(px); y.push(py); }
    }
    return {x, y, hovertext: ""};
  }

  function stretchesOf(columns) {
    const stretches = [[]];
    if (!columns || !columns.sigma) return [];
    columns.x.forEach((x, i) => {
      if (columns.sigma[i] === null) stretches.push([]);
      else stretches.at(-1).push([x, columns.y[i], columns.sigma[i]]);
    });
    return stretches.filter((stretch) => stretch.length > 1);
  }

  // Widen axes that span the site by what is mapped around it, though not by walks that were mapped far away. What was
  // discarded may run anywhere and counts only where nothing else is known.
  function widen(axes, parts) {
    const known = axes.filter((axis) => axis.range).map((axis) => axis.range[1] - axis.range[0]);
    const reach = Math.max(30, ...known.map((span) => span / 2));
    const [xs, ys] = ["x", "y"].map((axis) => parts.flatMap((part) =>
      ["ok", "uncertain"].flatMap((layer) => (part.layers[layer] || {x: [], y: []})[axis])));
    const near = (axis, value) => !axis.range || (value > axis.range[0] - reach && value < axis.range[1] + reach);
    const both = xs.map((x, i) => [x, ys[i]])
      .filter(([x, y]) => x !== null && near(axes[0], x) && near(axes[1], y));
    axes.forEach((axis, k) => {
      const [low, high] = both.reduce(([a, b], point) => [Math.min(a, point[k] - 1), Math.max(b, point[k] + 1)],
        axis.range || [Infinity, -Infinity]);
      if (low < high) axis.range = [low, high];
    });
  }

  function drawMap(section) {
    const div = section.querySelector(".map");
    const figure = figures.read(div);
    const visiting = document.querySelectorAll(`script.part[data-floor="${section.id.replace("floor-", "")}"]`);
    const parts = [...section.querySelectorAll("script.part:not([data-floor])"), ...visiting]
      .map((element) => JSON.parse(element.textContent));
    const layers = [];
    figure.data.forEach((trace, index) => {
      if (trace.meta) { layers.push(index); Object.assign(trace, joined(trace.meta, parts)); }
      trace.showlegend = trace.x.length > 0;
    });
    const full = layers.map((index) => figure.data[index]).map((trace) => ({...trace.line, ...trace.marker}));
    widen([figure.layout.xaxis, figure.layout.yaxis], parts);
    figures.map(div, figure);
    // Thinner lines and smaller dots keep many walks in one corridor distinguishable.
    const scaled = (wanted) => {
      const scale = wanted.length > 10 ? 0.5 : 1;
      return {
        "line.width": full.map((style) => style.width && scale * style.width),
        "marker.size": full.map((style) => style.size && (scale < 1 ? 0.7 : 1) * style.size),
      };
    };
    if (parts.length > 10) Plotly.restyle(div, scaled(parts), layers);
    const chooser = section.querySelector("select");
    chooser.add(new Option(`all sessions (${parts.length})`, "all"));
    parts.forEach((part, index) => chooser.add(new Option(part.name, index)));
    chooser.addEventListener("change", () => {
      const wanted = chooser.value === "all" ? parts : [parts[Number(chooser.value)]];
      const columns = layers.map((index) => joined(figure.data[index].meta, wanted));
      Plotly.restyle(div, {
        x: columns.map((column) => column.x),
        y: columns.map((column) => column.y),
        hovertext: columns.map((column) => column.hovertext),
        ...scaled(wanted),
      }, layers);
    });
  }

  function drawTimes() {
    const div = document.getElementById("times");
    const figure = figures.read(div);
    if (!figure.data.length) { div.hidden = true; return; }
    const columns = new Set(figure.data.flatMap((trace) => trace.customdata)).size;
    figure.layout.height = columns > 40 ? 320 : 480;
    if (columns > 40) figure.layout.xaxis.showticklabels = false;
    figures.chart(div, figure, {legend: {y: 1.12, traceorder: "normal"}, margin: {l: 48, r: 8, t: 64, b: 40}, share: 1});
    div.on("plotly_click", (event) => reveal(event.points[0].customdata));
  }

  // Open the details of a session and go there.
  function reveal(anchor) {
    const row = document.getElementById(anchor);
    if (!row) return;
    row.querySelector("details").open = true;
    row.scrollIntoView({block: "start", behavior: "smooth"});
  }

  function sortBy(header) {
    const table = header.closest("table");
    const column = header.cellIndex;
    const falling = header.getAttribute("aria-sort") !== "descending";
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    header.setAttribute("aria-sort", falling ? "descending" : "ascending");
    const key = (body) => body.rows[0].cells[column].dataset.sort;
    const compare = (a, b) => (isNaN(key(a)) ? key(a).localeCompare(key(b)) : key(a) - key(b));
    const bodies = [...table.tBodies].sort((a, b) => (falling ? compare(b, a) : compare(a, b)));
    table.append(...bodies);
  }

  figures.ready.then(() => {
    document.querySelectorAll("section.floor").forEach(drawMap);
    drawTimes();
  });
  document.querySelectorAll("th button").forEach((button) =>
    button.addEventListener("click", () => sortBy(button.closest("th"))));
  document.querySelectorAll("a[data-session]").forEach((link) =>
    link.addEventListener("click", () => reveal(link.hash.slice(1))));
})();
