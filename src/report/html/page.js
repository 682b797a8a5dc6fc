"use strict";
(() => {
  const holders = document.querySelectorAll(".chart");
  if (typeof Plotly === "undefined") {
    document.body.classList.add("stills");
    return;
  }
  const charts = JSON.parse(document.getElementById("charts").textContent);
  const narrow = window.matchMedia("(max-width: 600px)").matches;
  const coarse = window.matchMedia("(pointer: coarse)").matches;
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
  const draw = (holder) => {
    const chart = charts[Number(holder.dataset.chart)];
    Plotly.newPlot(holder, chart.traces, { ...shared, ...chart.layout }, options);
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
})();
