"use strict";
// Sorts the access points of each floor, and enlarges a map.
(() => {
  const dialog = document.querySelector("dialog");
  document.querySelectorAll("button.map").forEach((map) => map.addEventListener("click", () => {
    const large = document.createElement("div");
    large.className = "map";
    large.style.aspectRatio = map.style.aspectRatio;
    large.append(...[...map.childNodes].map((node) => node.cloneNode(true)));
    document.getElementById("enlarged").replaceChildren(large);
    document.getElementById("enlarged-title").textContent = map.dataset.title;
    dialog.showModal();
  }));
  const compare = (key) => (a, b) => (key === "readings" || key === "loudest"
    ? b.dataset[key] - a.dataset[key] : a.dataset[key].localeCompare(b.dataset[key]));
  document.getElementById("sort").addEventListener("change", (event) =>
    document.querySelectorAll(".sortable").forEach((list) =>
      list.append(...[...list.children].sort(compare(event.target.value)))));
})();
