// Formulas are typeset on the page: KaTeX lies beside this file (0.19.1, MIT), nothing is fetched.
document.querySelectorAll(".arithmatex").forEach((formula) => {
  const text = formula.textContent.replace(/^\\[([]|\\[)\]]$/g, "");
  katex.render(text, formula, { displayMode: formula.tagName === "DIV", throwOnError: false });
});
