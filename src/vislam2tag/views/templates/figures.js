"use strict";
// Draws the page's figures: each div.plot from the JSON beside it. Plotly is packed at the end of the page and is
// unpacked once the page's text is shown.
const figures = (() => {
  const CONFIG = {
    displaylogo: false,
    scrollZoom: true,
    doubleClick: "reset",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
  };
  const touch = matchMedia("(pointer: coarse)").matches;
  const drawn = [];
  const read = (div) => JSON.parse(div.nextElementSibling.textContent);

  async function unpack() {
    const bytes = Uint8Array.from(atob(document.getElementById("plotly").textContent), (letter) => letter.charCodeAt(0));
    const script = document.createElement("script");
    script.textContent = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
    document.head.append(script);
  }

  // A map as wide as it can be, as high as the plan asks, never higher than the window.
  function mapLayout(figure, width) {
    const wide = width > 760;
    const margin = {l: wide ? 56 : 30, r: wide ? 215 : 8, t: figure.bar ? 64 : 34, b: wide ? 48 : 28};
    const plan = (width - margin.l - margin.r) * figure.aspect;
    const height = Math.min(Math.max(plan, wide ? 330 : 140), Math.max(0.78 * innerHeight, 330));
    const columns = width > 560 ? 3 : 1;
    const rows = Math.ceil(figure.div.data.filter((trace) => trace.showlegend !== false && trace.visible !== false).length / columns);
    if (!wide) margin.b += 20 * rows + 8;
    const legend = wide
      ? {"legend.orientation": "v", "legend.x": 1.02, "legend.y": 1, "legend.yref": "paper", "legend.yanchor": "top"}
      : {"legend.orientation": columns > 1 ? "h" : "v", "legend.x": 0, "legend.y": 0, "legend.yref": "container",
         "legend.yanchor": "bottom"};
    const title = (name) => (wide ? `${name} / m` : "");
    return {...legend, "xaxis.title.text": title("x"), "yaxis.title.text": title("y"), margin, width, height: height + margin.t + margin.b};
  }

  function fit(figure, width) {
    const whole = width || figure.div.clientWidth;
    if (!whole) return;  // inside closed details
    Plotly.relayout(figure.div, figure.map ? mapLayout(figure, whole) : {width: width ? figure.share * width : whole});
  }

  function add(figure) {
    drawn.push(figure);
    if (figure.map) fit(figure);
    figure.div.closest("details")?.addEventListener("toggle", () => fit(figure));
    return figure.div;
  }

  // A floor in metres: its axes have ranges.
  function map(div, figure) {
    const span = (axis) => (axis.range ? axis.range[1] - axis.range[0] : 1);
    const aspect = span(figure.layout.yaxis) / span(figure.layout.xaxis);
    const bar = Boolean(figure.layout.coloraxis) || figure.data.some((trace) => trace.colorbar);
    if (touch) figure.layout.dragmode = false;
    figure.layout.width = div.clientWidth;
    Plotly.newPlot(div, figure.data, figure.layout, CONFIG);
    return add({div, map: true, aspect, bar});
  }

  function chart(div, figure, options = {}) {
    const layout = figure.layout;
    layout.height ??= 380;
    layout.legend = {orientation: "h", x: 0, y: 1.02, yanchor: "bottom", ...options.legend};
    layout.margin = {l: 56, r: 12, t: layout.showlegend === false ? 12 : 44, b: 48, ...options.margin};
    layout.width = div.clientWidth || undefined;
    Plotly.newPlot(div, figure.data, layout, {displayModeBar: false});
    return add({div, share: options.share ?? 0.5});
  }

  const ready = new Promise((resolve) => addEventListener("DOMContentLoaded", () => setTimeout(resolve))).then(unpack);
  ready.then(() => document.querySelectorAll("div.plot:not([data-own])").forEach((div) =>
    (div.classList.contains("map") ? map : chart)(div, read(div))));
  ready.catch(() => document.querySelectorAll("div.plot").forEach((div) => {
    div.textContent = "This browser is too old to draw the figure. The rest of the page is complete.";
  }));
  const resize = (width) => drawn.forEach((figure) => fit(figure, width));
  let pending = 0;
  addEventListener("resize", () => { clearTimeout(pending); pending = setTimeout(resize, 150); });
  addEventListener("beforeprint", () => resize(680));
  addEventListener("afterprint", () => resize());
  return {ready, read, map, chart};
})();
