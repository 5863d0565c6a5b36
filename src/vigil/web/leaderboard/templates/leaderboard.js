"use strict";
// Shows the entries that the filters ask for, in the tables and in the plots.
(() => {
  const selects = [...document.querySelectorAll("[data-filter]")];
  if (!selects.length) return;
  const rows = [...document.querySelectorAll("tr[data-tier]")];
  const filter = () => {
    const isWanted = (row) => selects.every((each) => !each.value || row.dataset[each.dataset.filter] === each.value);
    const wanted = new Set(rows.filter(isWanted).map((row) => row.dataset.entry));
    for (const node of document.querySelectorAll("[data-entry]")) node.toggleAttribute("hidden", !wanted.has(node.dataset.entry));
    for (const board of document.querySelectorAll(".board")) board.hidden = !board.querySelector("tr[data-tier]:not([hidden])");
    for (const pack of document.querySelectorAll(".pack")) pack.hidden = !pack.querySelector(".board:not([hidden])");
    document.getElementById("shown").textContent = `${wanted.size} of ${rows.length} entries`;
  };
  for (const select of selects) select.addEventListener("change", filter);
  filter();
})();
