// Draws panels of lines with Plotly over time, with a cursor at the player's time, or over
// another quantity, with what happens along it.
"use strict";

const PANEL = 190; // px
const GAP = 52; // px, between panels

class Plots {
  constructor(root, { panels, spans, axis }) {
    this.root = root;
    this.panels = panels;
    this.spans = spans;
    this.axis = axis; // of time, if none is given
    this.plot = root.querySelector(".plot");
    this.cursor = root.querySelector(".cursor");
    this.time = null;
    this.draw();
    this.plot.on("plotly_afterplot", () => this.mark(this.time));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  draw() {
    const style = getComputedStyle(this.root);
    const ink = style.getPropertyValue("--ink").trim();
    const faint = style.getPropertyValue("--rule").trim();
    const whole = this.panels.length * (PANEL + GAP);
    const traces = [];
    const layout = {
      height: whole + (this.axis ? 50 : 30),
      margin: { l: 62, r: 8, t: 4, b: this.axis ? 46 : 26 },
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { color: ink, family: "system-ui, sans-serif", size: 12 },
      hovermode: this.axis ? "closest" : "x unified",
      hoverlabel: { bgcolor: style.getPropertyValue("--paper").trim() },
      annotations: [],
      shapes: [...this.stances(), ...this.landmarks(ink)],
    };
    this.panels.forEach((panel, number) => {
      const suffix = number ? String(number + 1) : "";
      const high = 1 - (number * (PANEL + GAP) + GAP * 0.6) / whole;
      const low = high - PANEL / whole;
      layout[`yaxis${suffix}`] = {
        domain: [Math.max(0, low), high], type: panel.log ? "log" : "linear",
        gridcolor: faint, zeroline: false, automargin: false,
      };
      layout[`xaxis${suffix}`] = {
        anchor: `y${suffix}`, gridcolor: faint, zeroline: false, hoverformat: ".4f",
        showticklabels: true, ticks: "outside", tickcolor: "rgba(0,0,0,0)",
        ...(this.axis ? {} : { ticksuffix: " s" }), ...(number ? { matches: "x" } : {}),
      };
      if (this.axis && number === this.panels.length - 1) {
        layout[`xaxis${suffix}`].title = { text: this.axis.title };
      }
      if (panel.level !== undefined) {
        layout.shapes.push({
          type: "line", xref: "paper", yref: `y${suffix}`, x0: 0, x1: 1, y0: panel.level,
          y1: panel.level, line: { color: ink, width: 1, dash: "dash" },
        });
      }
      layout[`legend${suffix}`] = {
        orientation: "h", x: 1, xanchor: "right", y: high, yanchor: "bottom",
        bgcolor: "rgba(0,0,0,0)",
      };
      layout.annotations.push({
        text: `<b>${panel.title}</b>${panel.unit && ` (${panel.unit})`}`, xref: "paper", yref: "paper", x: 0, y: high,
        xanchor: "left", yanchor: "bottom", showarrow: false,
      });
      for (const line of panel.lines) {
        traces.push({
          x: line.x, y: line.y, name: line.name, type: "scatter", mode: "lines",
          xaxis: `x${suffix}`, yaxis: `y${suffix}`, legend: `legend${suffix}`,
          legendrank: line.dash === "solid" ? 1 : 2,
          showlegend: line.legend && panel.lines.length > 1,
          line: { color: line.color === "ink" ? ink : line.color, width: 1.5, dash: line.dash },
        });
      }
    });
    Plotly.react(this.plot, traces, layout, {
      responsive: true, displaylogo: false, modeBarButtonsToRemove: ["lasso2d", "select2d"],
    });
  }

  // Tints of the legs that stand.
  stances() {
    return this.spans.map(([start, end, color]) => ({
      type: "rect", xref: "x", yref: "paper", x0: start, x1: end, y0: 0, y1: 1,
      fillcolor: color, opacity: 0.25, line: { width: 0 }, layer: "below",
    }));
  }

  landmarks(ink) {
    return ((this.axis && this.axis.marks) || []).map((value) => ({
      type: "line", xref: "x", yref: "paper", x0: value, x1: value, y0: 0, y1: 1,
      line: { color: ink, width: 1, dash: "dot" }, layer: "below",
    }));
  }

  // Puts the cursor at a time in s; it is hidden outside of what is shown.
  mark(time) {
    this.time = time;
    const axis = this.plot._fullLayout && this.plot._fullLayout.xaxis;
    if (time === null || !axis) return;
    const place = axis.d2p(time);
    this.cursor.hidden = place < 0 || place > axis._length;
    this.cursor.style.left = `${axis._offset + place}px`;
  }
}
