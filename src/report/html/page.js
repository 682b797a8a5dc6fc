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
  const shared = {
    font: { family: getComputedStyle(document.body).fontFamily, size: narrow ? 11 : 12, color: "#1d232b" },
    margin: { l: narrow ? 48 : 60, r: 12, t: coarse || narrow ? 8 : 30, b: 44 },
    paper_bgcolor: "#ffffff",
    plot_bgcolor: "#ffffff",
    legend: { orientation: "h", x: 0, xanchor: "left", y: -0.2, yanchor: "top" },
    hoverlabel: { namelength: -1 },
    // On a touch screen a drag scrolls the page and does not zoom.
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
      // trace.x is an index into the list of shared arrays.
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
  // Browsers without DecompressionStream (some before 2023) show the static images.
  drawAll().catch((error) => {
    document.body.classList.add("stills");
    console.error(error);
  });
})();
