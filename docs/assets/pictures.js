// Pictures of the studio follow the page: NAME_light.webp is NAME_dark.webp on a dark page.
(() => {
  const follow = () => {
    const scheme = document.body.dataset.mdColorScheme === "slate" ? "dark" : "light";
    for (const picture of document.querySelectorAll('img[src*="/studio_"]')) {
      const wanted = picture.src.replace(/_(light|dark)\.webp$/, `_${scheme}.webp`);
      if (picture.src !== wanted) picture.src = wanted;
    }
  };
  document.addEventListener("DOMContentLoaded", () => {
    follow();
    new MutationObserver(follow).observe(document.body, { attributeFilter: ["data-md-color-scheme"] });
  });
})();
