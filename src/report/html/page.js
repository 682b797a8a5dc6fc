"use strict";
(() => {
  const holders = document.querySelectorAll(".chart");
  const narrow = window.matchMedia("(max-width: 600px)").matches;
  const coarse = window.matchMedia("(pointer: coarse)").matches;
  // plotly.js stands on the page as base64 of gzip.
  const load = async () => {
    const packed = Uint8Array.from(atob(document.getElementById("plotly").textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.textContent = await new Response(stream).text();
    document.head.append(script);
  };
  const shared = {
    font: { family: getComputedStyle(document.body).fontFamily, size: narrow ? 11 : 12, color: "#1d232b" },
    margin: { l: narrow ? 48 : 60, r: 12, t: coarse || narrow ? 8 : 30, b: 44 },
    paper_bgcolor: "#ffffff",
    plot_bgcolor: "#ffffff",
    legend: { orientation: "h", x: 0, xanchor: "left", y: -0.2, yanchor: "top" },
    hoverlabel: { namelength: -1 },
    // A finger that scrolls the page must not zoom a chart.
    dragmode: coarse || narrow ? false : "zoom",
  };
  const options = {
    responsive: true,
    displaylogo: false,
    displayModeBar: coarse || narrow ? false : "hover",
    modeBarButtonsToRemove: ["lasso2d", "select2d", "autoScale2d"],
  };
  const drawAll = async () => {
    const { charts, x } = JSON.parse(document.getElementById("charts").textContent);
    await load();
    const draw = (holder) => {
      const chart = charts[Number(holder.dataset.chart)];
      // Traces share their x: each has the index of an array.
      const traces = chart.traces.map((trace) => ("x" in trace ? { ...trace, x: x[trace.x] } : trace));
      Plotly.newPlot(holder, traces, { ...shared, ...chart.layout }, options);
    };
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
  // A browser that cannot decompress (before 2023, some) shows the still images, as without scripts.
  drawAll().catch((error) => {
    document.body.classList.add("stills");
    console.error(error);
  });
})();
