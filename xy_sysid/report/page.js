"use strict";
(() => {
  const { plots, templates } = JSON.parse(document.getElementById("plots").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const config = { responsive: true, displayModeBar: matchMedia("(hover: hover)").matches ? "hover" : false, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  const drawn = new Set();
  const draw = (name) => {
    const plot = plots[name];
    const layout = { ...structuredClone(plot.layout), template: templates[dark.matches ? "dark" : "light"], autosize: true };
    drawn.add(name);
    return Plotly.react(name, structuredClone(plot.data), layout, config);
  };
  const near = new IntersectionObserver((seen) => {
    for (const { isIntersecting, target } of seen) {
      if (isIntersecting) { near.unobserve(target); draw(target.id); }
    }
  }, { rootMargin: "800px" });
  for (const name of Object.keys(plots)) near.observe(document.getElementById(name));
  dark.addEventListener("change", () => drawn.forEach(draw));
  addEventListener("beforeprint", () => Object.keys(plots).filter((name) => !drawn.has(name)).forEach(draw));
})();
