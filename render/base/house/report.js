"use strict";
// Light or dark, as the system has it until the button is pressed; tables that are sorted by a click on a column's head.
{
  const root = document.documentElement, dark = matchMedia("(prefers-color-scheme: dark)");
  const set = on => { root.dataset.theme = on ? "dark" : "light"; };
  set(dark.matches);
  dark.addEventListener("change", e => set(e.matches));
  document.getElementById("theme").addEventListener("click", () => set(root.dataset.theme !== "dark"));

  // The first number of a cell; without one it stands at the end, whichever way is sorted.
  const number = cell => {
    const found = /-?\d+(\.\d*)?(e[-+]?\d+)?/i.exec(cell.textContent);
    return found ? Number(found[0]) : null;
  };
  for (const table of document.querySelectorAll("table.sorted")) {
    const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, k) => {
      head.setAttribute("aria-sort", "none");
      head.tabIndex = 0;
      const sort = () => {
        const up = head.getAttribute("aria-sort") !== "ascending";
        for (const other of heads) other.setAttribute("aria-sort", "none");
        head.setAttribute("aria-sort", up ? "ascending" : "descending");
        const numbers = head.dataset.kind === "number";
        const rows = [...body.rows].map(row => [row, numbers ? number(row.cells[k]) : row.cells[k].textContent]);
        rows.sort(([, a], [, b]) => {
          if (!numbers) return (up ? 1 : -1) * a.localeCompare(b);
          if (a === null || b === null) return (a === null) - (b === null);
          return (up ? 1 : -1) * (a - b);
        });
        body.append(...rows.map(([row]) => row));
      };
      head.addEventListener("click", sort);
      head.addEventListener("keydown", e => {
        if (e.key === "Enter") sort();
      });
    });
  }
}
