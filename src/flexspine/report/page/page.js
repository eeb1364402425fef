// Joins players and plots of the same run, and lets tables be put in order.
"use strict";

const read = (id) => JSON.parse(document.getElementById(id).textContent);

for (const root of document.querySelectorAll("[data-run]")) {
  const player = new Player(root.querySelector(".player"), read(`${root.dataset.run}-reel`));
  const plots = new Plots(root.querySelector(".plots"), read(`${root.dataset.run}-panels`));
  player.listeners.push((time) => plots.mark(time));
  plots.plot.on("plotly_click", (event) => player.seek(event.points[0].x));
  player.show(0);
}

for (const root of document.querySelectorAll("[data-branch]")) {
  new Plots(root.querySelector(".plots"), read(root.dataset.branch));
}

for (const root of document.querySelectorAll("[data-scatter]")) {
  new Scatter(root, read(root.dataset.scatter));
}

for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    head.firstChild.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      heads.forEach((each) => each.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const body = table.tBodies[0];
      const value = (row) => row.cells[column].dataset.value ?? row.cells[column].textContent;
      const compare = (one, other) => {
        const [a, b] = [value(one), value(other)];
        const difference = Number(a) - Number(b);
        return Number.isNaN(difference) ? a.localeCompare(b) : difference;
      };
      const rows = [...body.rows].sort((a, b) => (down ? compare(b, a) : compare(a, b)));
      body.append(...rows);
    });
  });
}
