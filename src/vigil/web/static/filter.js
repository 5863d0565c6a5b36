"use strict";
// An exported run: shows the episodes that the address asks for (#family=PG&label=FR).
(() => {
  const filter = () => {
    const wanted = new URLSearchParams(location.hash.slice(1));
    const rows = [...document.querySelectorAll(".episodes tbody tr")];
    for (const row of rows) row.hidden = ["family", "label"].some((name) => wanted.get(name) && wanted.get(name) !== row.dataset[name]);
    document.getElementById("count").textContent = rows.filter((row) => !row.hidden).length;
    const isAll = !wanted.get("family") && !wanted.get("label");
    document.getElementById("all").hidden = isAll;
    if (!isAll) document.getElementById("episodes").scrollIntoView();
  };
  window.addEventListener("hashchange", filter);
  filter();
})();
