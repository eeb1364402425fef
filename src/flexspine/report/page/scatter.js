// Draws a column of a table over another, in the colours of a third, all rows or some, as chosen.
"use strict";

const COLORS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8a8a8a", "#5E3C99"];
const SCATTER = 380; // px
const DOT = 6; // px

class Scatter {
  constructor(root, { numbers, texts, heads }) {
    this.root = root;
    this.numbers = numbers;
    this.texts = texts;
    this.heads = heads;
    this.plot = root.querySelector(".plot");
    root.addEventListener("change", () => this.draw());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    this.draw();
  }

  chosen(name) {
    const select = this.root.querySelector(`select[name="${name}"]`);
    return select ? select.value : "";
  }

  draw() {
    const [x, y, color] = ["across", "up", "colour"].map((name) => this.chosen(name));
    const style = getComputedStyle(this.root);
    const ink = style.getPropertyValue("--ink").trim();
    const faint = style.getPropertyValue("--rule").trim();
    const scale = this.chosen("scale");
    const axis = (name, way) => ({
      type: scale === "log both" || scale === `log ${way}` ? "log" : "linear",
      exponentformat: "power", title: { text: this.heads[name] }, gridcolor: faint, zeroline: false, automargin: true,
    });
    const layout = {
      height: SCATTER, margin: { l: 70, r: 10, t: 10, b: 55 }, hovermode: "closest",
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { color: ink, family: "system-ui, sans-serif", size: 12 },
      xaxis: axis(x, "across"), yaxis: axis(y, "up"),
      legend: { title: { text: this.heads[color] || "" } },
    };
    Plotly.react(this.plot, this.traces(x, y, color, ink), layout, {
      responsive: true, displaylogo: false, modeBarButtonsToRemove: ["lasso2d", "select2d"],
    });
  }

  // The rows that are drawn.
  rows() {
    const only = this.chosen("only");
    const [name, value] = only ? JSON.parse(only) : [];
    const all = Object.values(this.numbers)[0].map((_, row) => row);
    return only ? all.filter((row) => this.texts[name][row] === value) : all;
  }

  traces(x, y, color, ink) {
    const rows = this.rows();
    if (color in this.numbers) {
      const values = rows.map((row) => this.numbers[color][row]);
      const bar = { title: { text: this.heads[color], side: "right" }, thickness: 14 };
      const marker = { size: DOT, color: values, colorscale: "Viridis", colorbar: bar };
      const text = values.map((value) => `${this.heads[color]} = ${value}`);
      return [{ ...this.trace(x, y, rows, ink), mode: "markers", marker, text }];
    }
    if (!(color in this.texts)) return [this.trace(x, y, rows, ink)];
    const names = [...new Set(this.texts[color])].sort();
    const traces = names.map((name, place) => ({
      ...this.trace(
        x, y, rows.filter((row) => this.texts[color][row] === name), COLORS[place % COLORS.length],
      ),
      name, showlegend: true,
    }));
    return traces.filter((trace) => trace.x.length);
  }

  // Points of one colour; joined where each is farther across than the one before.
  trace(x, y, rows, color) {
    const [across, up] = [x, y].map((name) => rows.map((row) => this.numbers[name][row]));
    const rises = across.every((value, place) => place === 0 || value > across[place - 1]);
    return {
      type: "scatter", mode: rises ? "lines+markers" : "markers", showlegend: false,
      x: across, y: up, marker: { size: DOT, color }, line: { color, width: 1 },
    };
  }
}
