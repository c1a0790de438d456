// Tables that are wider than the page get less room between words, then one line for each cell.
(() => {
  const STEPS = ["", "dense", "stacked"];
  const PHONE = 720; // below it, rows are stacked if they are lower then
  const tables = () => document.querySelectorAll(".md-content table:not([class])");
  const nameCells = (table) => {
    const names = [...table.querySelectorAll("thead th")].map((cell) => cell.textContent.trim());
    for (const row of table.querySelectorAll("tbody tr"))
      [...row.cells].forEach((cell, at) => names[at] && (cell.dataset.column = names[at]));
  };
  const set = (table, step) => {
    table.dataset.fit = step;
    const room = table.parentElement.clientWidth;
    return table.offsetWidth <= room && table.scrollWidth <= room;
  };
  const fit = (table) => {
    const step = STEPS.find((one) => set(table, one)) ?? "stacked";
    const height = table.offsetHeight;
    if (innerWidth < PHONE && step !== "stacked" && set(table, "stacked") && table.offsetHeight < height) return;
    set(table, step);
  };
  const fitAll = () => tables().forEach(fit);
  document.addEventListener("DOMContentLoaded", () => {
    tables().forEach(nameCells);
    fitAll();
  });
  window.addEventListener("load", fitAll);
  window.addEventListener("resize", fitAll);
})();
