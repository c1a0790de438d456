"use strict";
// Colours a floor's fingerprints by what is chosen.
figures.ready.then(() => document.querySelectorAll("div.covered").forEach((part) => {
  const div = part.querySelector(".map");
  const points = div.data.flatMap((trace, index) => (trace.meta === "fingerprints" ? [index] : []));
  const cells = div.data.findIndex((trace) => trace.meta === "counts");
  const devices = points.map((index) => div.data[index].marker.color);
  part.querySelector("select").addEventListener("change", (event) => {
    const wanted = event.target.value;
    const values = points.map((index) => div.data[index].customdata.map((row) => row[wanted]));
    const coloured = wanted === "0" || wanted === "1";
    Plotly.restyle(div, {visible: wanted === "counts"}, [cells]);
    if (!points.length) return;
    Plotly.restyle(div, {
      visible: wanted !== "counts",
      "marker.color": coloured ? values : devices,
      "marker.coloraxis": coloured ? "coloraxis" : null,
      showlegend: !coloured,
    }, points);
    Plotly.relayout(div, {
      "coloraxis.showscale": coloured,
      "coloraxis.colorbar.title.text": wanted === "0" ? "sigma / m" : "readings",
    });
  });
}));
