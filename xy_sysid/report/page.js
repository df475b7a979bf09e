"use strict";
(() => {
  const { plots, templates } = JSON.parse(document.getElementById("plots").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const config = { responsive: true, displayModeBar: matchMedia("(hover: hover)").matches ? "hover" : false, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  const draw = () => {
    for (const [name, plot] of Object.entries(plots)) {
      const layout = { ...structuredClone(plot.layout), template: templates[dark.matches ? "dark" : "light"], autosize: true };
      Plotly.react(name, structuredClone(plot.data), layout, config);
    }
  };
  dark.addEventListener("change", draw);
  draw();
})();
