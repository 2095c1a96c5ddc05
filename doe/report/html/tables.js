"use strict";
// Sortable tables: the heads become buttons. Tables wider than the page: keys can reach and scroll them.
(() => {
  function key(row, column) {
    const text = row.cells[column].textContent, number = parseFloat(text.replace(/^[^\d+.-]+/, ""));
    return Number.isNaN(number) ? text : number;
  }

  function sort(table, column, head) {
    const up = head.getAttribute("aria-sort") !== "ascending";
    const body = table.tBodies[0];
    const rows = [...body.rows].map((row, place) => [key(row, column), place, row]);
    const compare = (a, b) => typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b));
    rows.sort((a, b) => (up ? 1 : -1) * compare(a[0], b[0]) || a[1] - b[1]);
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    body.append(...rows.map(row => row[2]));
  }

  for (const table of document.querySelectorAll("table.sortable"))
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      if (!head.textContent) return;
      const button = page.element("button", head.textContent, {type: "button", class: "sort"});
      button.addEventListener("click", () => sort(table, column, head));
      head.replaceChildren(button);
    });

  page.draws(() => {
    for (const each of document.querySelectorAll(".scroll"))
      if (each.scrollWidth > each.clientWidth) each.tabIndex = 0; else each.removeAttribute("tabindex");
  });

  document.addEventListener("toggle", page.redraw, true);

  // Paper shows what belongs to the question; further figures stay folded.
  const folded = () => document.querySelectorAll("#asked details:not([open]), #design details:not([open])");
  let opened = [];
  window.addEventListener("beforeprint", () => {
    opened = [...folded()];
    for (const each of opened) each.open = true;
  });
  window.addEventListener("afterprint", () => { for (const each of opened) each.open = false; });
})();
