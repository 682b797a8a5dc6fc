"use strict";
(() => {
  const holders = document.querySelectorAll(".chart");
  const narrow = window.matchMedia("(max-width: 600px)").matches;
  const coarse = window.matchMedia("(pointer: coarse)").matches;
  // plotly.js is on the page as gzip in base64.
  const load = async () => {
    const packed = Uint8Array.from(atob(document.getElementById("plotly").textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.textContent = await new Response(stream).text();
    document.head.append(script);
  };
  const root = document.documentElement;
  const variable = (name) => getComputedStyle(root).getPropertyValue(name).trim();
  const isDark = () => root.dataset.theme === "dark";

  // Colours of the charts are chosen for white. On a dark page white becomes the page, greys are inverted, and other
  // colours are mixed with white until their contrast is 3:1, that of WCAG 2 for graphics.
  const luminance = (rgb) => {
    const [r, g, b] = rgb.map((v) => (v <= 10.31475 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const contrast = (one, other) => {
    const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05);
  };
  const triple = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
  const onDark = (rgb, paper) => {
    const [r, g, b] = rgb;
    if (r === g && g === b) return r === 255 ? paper : rgb.map((v) => 255 - v);
    for (let white = 0; white < 1; white += 0.05) {
      const mixed = rgb.map((v) => Math.round(v + (255 - v) * white));
      if (contrast(mixed, paper) >= 3) return mixed;
    }
    return [255, 255, 255];
  };
  const colour = (text, paper) => {
    if (text === "white") return `rgb(${paper})`;
    if (/^#[0-9a-f]{6}$/.test(text)) return `rgb(${onDark(triple(text), paper)})`;
    const faded = /^rgba\((\d+),(\d+),(\d+),([\d.]+)\)$/.exec(text);
    return faded ? `rgba(${onDark(faded.slice(1, 4).map(Number), paper)},${faded[4]})` : text;
  };
  // Data and texts are not colours.
  const data = new Set(["x", "y", "z", "text", "customdata", "name", "hovertemplate", "array", "arrayminus", "args"]);
  const recoloured = (value, paper) => {
    if (typeof value === "string") return colour(value, paper);
    if (Array.isArray(value)) return value.map((entry) => recoloured(entry, paper));
    if (value === null || typeof value !== "object") return value;
    return Object.fromEntries(
      Object.entries(value).map(([key, entry]) => [key, data.has(key) ? entry : recoloured(entry, paper)]),
    );
  };

  const layoutOf = (chart) => {
    const [ink, paper, rule, soft] = ["--ink", "--paper", "--rule", "--soft"].map(variable);
    const axis = { gridcolor: rule, linecolor: soft, zerolinecolor: soft };
    const layout = {
      font: { family: getComputedStyle(document.body).fontFamily, size: narrow ? 11 : 12, color: ink },
      margin: { l: narrow ? 48 : 60, r: 12, t: coarse || narrow ? 8 : 30, b: 44 },
      paper_bgcolor: paper,
      plot_bgcolor: paper,
      legend: { orientation: "h", x: 0, xanchor: "left", y: -0.2, yanchor: "top" },
      hoverlabel: { namelength: -1, bgcolor: paper, bordercolor: soft, font: { color: ink } },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: soft, activecolor: ink },
      template: { layout: { xaxis: axis, yaxis: axis } },
      // On a touch screen a drag scrolls the page and does not zoom.
      dragmode: coarse || narrow ? false : "zoom",
      ...chart.layout,
    };
    const slider = { bgcolor: rule, activebgcolor: soft, bordercolor: soft, tickcolor: soft };
    if (layout.sliders) layout.sliders = layout.sliders.map((own) => ({ ...slider, ...own }));
    return layout;
  };
  const options = {
    responsive: true,
    displaylogo: false,
    displayModeBar: coarse || narrow ? false : "hover",
    modeBarButtonsToRemove: ["lasso2d", "select2d", "autoScale2d"],
  };
  const drawn = new Set();
  const drawAll = async () => {
    const { charts, x } = JSON.parse(document.getElementById("charts").textContent);
    await load();
    const draw = (holder) => {
      const chart = charts[Number(holder.dataset.chart)];
      const paper = triple(variable("--paper"));
      // trace.x is an index into the list of shared arrays.
      const traces = chart.traces.map((trace) => {
        const own = isDark() ? recoloured(trace, paper) : trace;
        return "x" in trace ? { ...own, x: x[trace.x] } : own;
      });
      Plotly.react(holder, traces, layoutOf(chart), options);
      drawn.add(holder);
    };
    document.getElementById("theme").addEventListener("click", () => drawn.forEach(draw));
    if (!("IntersectionObserver" in window)) {
      holders.forEach(draw);
      return;
    }
    const watch = new IntersectionObserver(
      (entries) => {
        for (const entry of entries.filter((entry) => entry.isIntersecting)) {
          watch.unobserve(entry.target);
          draw(entry.target);
        }
      },
      { rootMargin: "400px" },
    );
    holders.forEach((holder) => watch.observe(holder));
  };
  const button = document.getElementById("theme");
  const label = () => (button.textContent = isDark() ? "Light page" : "Dark page");
  button.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    label();
  });
  button.hidden = false;
  label();
  // Browsers without DecompressionStream (some before 2023) show the static images.
  drawAll().catch((error) => {
    document.body.classList.add("stills");
    console.error(error);
  });
})();
