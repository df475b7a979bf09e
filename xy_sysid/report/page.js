"use strict";
(() => {
  const { plots, templates } = JSON.parse(document.getElementById("plots").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const config = { responsive: true, displayModeBar: false };
  const PAPER = { titles: 90, curves: 0.45, font: 11 }; // px of a figure's height that stay, the part of the rest that is kept, px of its words
  const drawn = new Set();
  const shown = (name) => document.getElementById(name).offsetParent; // not one of a group that its menu hides
  let printing = false;
  const draw = (name) => {
    const plot = plots[name];
    const mode = dark.matches && !printing ? "dark" : "light";
    const layout = { ...structuredClone(plot.layout), template: templates[mode], autosize: true };
    const box = document.getElementById(name);
    const height = printing ? Math.round(PAPER.titles + PAPER.curves * plot.layout.height) : plot.layout.height;
    box.style.height = `${height}px`;
    if (printing) Object.assign(layout, { autosize: false, width: box.clientWidth, height, font: { ...layout.font, size: PAPER.font } });
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
  const turn = (on) => {
    printing = on;
    document.documentElement.classList.toggle("printing", on);
    (on ? Object.keys(plots) : [...drawn]).filter(shown).forEach(draw);
  };
  addEventListener("beforeprint", () => turn(true));
  addEventListener("afterprint", () => turn(false));

  // a menu shows one group of figures
  addEventListener("change", ({ target }) => {
    if (target.dataset.choice) [...document.getElementById(target.dataset.choice).children].forEach((group, place) => { group.hidden = place !== target.selectedIndex; });
  });

  // keep a figure: as vectors, or its numbers
  const numbers = (values) => values && values.bdata ? Array.from(Plotly.Snapshot ? decoded(values) : []) : Array.from(values || []);
  const kinds = { f8: Float64Array, f4: Float32Array, i4: Int32Array, i2: Int16Array, i1: Int8Array, u1: Uint8Array, u2: Uint16Array, u4: Uint32Array };
  const decoded = (values) => new kinds[values.dtype](Uint8Array.from(atob(values.bdata), (letter) => letter.charCodeAt(0)).buffer);
  const quoted = (text) => /[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
  const table = (plot) => {
    const columns = [];
    plot.data.forEach((trace, place) => ["x", "y"].forEach((letter) => {
      const axis = plot.layout[`${letter}axis${(trace[`${letter}axis`] || letter).slice(1)}`] || {};
      const title = axis.title && axis.title.text || (trace.meta || {})[letter] || letter;
      if (trace[letter]) columns.push([`${(trace.name || `curve ${place + 1}`).replace(/<br>/g, " ")}: ${title}`, ...numbers(trace[letter])]);
    }));
    const longest = Math.max(0, ...columns.map((column) => column.length));
    const lines = Array.from({ length: longest }, (_, k) => columns.map((column) => column[k] == null || Number.isNaN(column[k]) ? "" : quoted(String(column[k]))).join(","));
    return lines.join("\n") + "\n";
  };
  const give = (text, name) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  document.addEventListener("click", (event) => {
    const { keep, of } = event.target.dataset || {};
    if (!keep) return;
    if (keep === "csv") give(table(plots[of]), `${of}.csv`);
    else Promise.resolve(drawn.has(of) || draw(of)).then(() => Plotly.downloadImage(of, { format: keep, filename: of }));
  });
})();
