"use strict";
// The page of a person who plays: it knows the picture, the instruction and the four skills, nothing else.
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const at = (id) => document.getElementById(id);
  const frame = at("frame");
  const menu = at("menu");
  const report = at("report");
  let state = null;
  let busy = false;
  let wasOn = false;
  let spot = null; // the pixel that is pointed at
  let pointing = false; // the cross is moved by keys

  async function ask(path, body) {
    if (busy) return;
    busy = true;
    at("wait").textContent = "…";
    try {
      const options = body === undefined ? {} : { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
      const answer = await fetch(path, options);
      const found = await answer.json();
      if (!answer.ok) throw new Error(found.error ?? "The server did not take that.");
      show(found);
      at("wait").textContent = "";
    } catch (error) {
      at("wait").textContent = `${error.message} Try again.`;
    }
    busy = false;
    document.documentElement.dataset.answers = Number(document.documentElement.dataset.answers ?? 0) + 1;
  }

  function show(found) {
    state = found;
    point(null);
    at("tally").textContent = `${found.player}${found.practice ? " · practice" : ""} · ${found.done} of ${found.of} done`;
    at("game").hidden = !found.is_on;
    at("lobby").hidden = found.is_on;
    if (!found.is_on) {
      const told = at("told");
      told.replaceChildren();
      for (const text of found.told) {
        const line = document.createElement("p");
        line.textContent = text;
        told.append(line);
      }
      at("ended").hidden = !wasOn;
      wasOn = false;
      const isOver = found.done >= found.of;
      at("over").hidden = !isOver;
      at("begin").hidden = isOver;
      at("begin").textContent = found.done ? "Next episode" : "Begin";
      at("begin").focus();
      return;
    }
    wasOn = true;
    at("picture").src = found.frame;
    at("instruction").textContent = found.instruction;
    at("prompt").textContent = found.prompt;
    const said = found.feedback;
    const words = [];
    if (said && said.too_far) words.push("It is too far away to reach.");
    if (said && said.path_blocked) words.push("Something is in the way.");
    at("feedback").hidden = words.length === 0;
    at("feedback").textContent = words.join(" ");
  }

  function reply(skill_name, given) {
    if (!state || !state.is_on || busy) return;
    point(null);
    ask("/reply", { moment: state.moment, text: JSON.stringify({ skill_name, arguments: given }) });
  }

  const amount = (id) => Number(at(id).value) || 1;
  const MOVES = {
    forward: () => reply("navigate", { mode: "forward", magnitude: amount("steps") }),
    backward: () => reply("navigate", { mode: "backward", magnitude: amount("steps") }),
    turn_left: () => reply("navigate", { mode: "turn_left", magnitude: amount("turn") }),
    turn_right: () => reply("navigate", { mode: "turn_right", magnitude: amount("turn") }),
    look_up: () => reply("look", { direction: "up", magnitude: amount("tilt") }),
    look_down: () => reply("look", { direction: "down", magnitude: amount("tilt") }),
  };
  const drop = () => reply("interact_pixel", { intent: "drop" });

  // --- pointing at the picture --------------------------------------------------------------------------------------
  function point(where) {
    spot = where;
    menu.hidden = true;
    if (!where) pointing = false;
    const cross = at("cross");
    cross.replaceChildren();
    if (!where) return;
    const [x, y] = where;
    for (const kind of ["click-ring", "click-core"]) {
      for (const [x1, y1, x2, y2] of [[x - 18, y, x - 5, y], [x + 5, y, x + 18, y], [x, y - 18, x, y - 5], [x, y + 5, x, y + 18]]) {
        const line = document.createElementNS(SVG, "line");
        for (const [name, value] of Object.entries({ x1, y1, x2, y2, class: kind })) line.setAttribute(name, value);
        cross.append(line);
      }
    }
  }

  function openMenu() {
    menu.hidden = false;
    const box = frame.getBoundingClientRect();
    const x = (spot[0] / 640) * box.width;
    const y = (spot[1] / 480) * box.height;
    menu.style.left = `${Math.max(4, Math.min(x + 14, box.width - menu.offsetWidth - 4))}px`;
    menu.style.top = `${Math.max(4, Math.min(y - 20, box.height - menu.offsetHeight - 4))}px`;
    menu.querySelector("button").focus();
  }

  function choose(intent) {
    if (spot) reply("interact_pixel", { intent, x: spot[0], y: spot[1] });
  }

  at("picture").addEventListener("click", (event) => {
    const box = at("picture").getBoundingClientRect();
    const x = Math.min(639, Math.max(0, Math.floor(((event.clientX - box.left) / box.width) * 640)));
    const y = Math.min(479, Math.max(0, Math.floor(((event.clientY - box.top) / box.height) * 480)));
    point([x, y]);
    openMenu();
  });
  for (const button of menu.querySelectorAll("button")) button.onclick = () => choose(button.dataset.intent);

  function pointByKeys(event) {
    const step = event.shiftKey ? 2 : 16;
    const ways = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    const way = ways[event.key];
    if (way) {
      point([Math.min(639, Math.max(0, spot[0] + way[0])), Math.min(479, Math.max(0, spot[1] + way[1]))]);
      pointing = true;
      return true;
    }
    if (event.key === "Enter") {
      openMenu();
      return true;
    }
    return false;
  }

  function menuKey(event) {
    const items = [...menu.querySelectorAll("button")];
    const index = items.indexOf(document.activeElement);
    if (event.key === "ArrowDown") items[(index + 1) % items.length].focus();
    else if (event.key === "ArrowUp") items[(index + items.length - 1) % items.length].focus();
    else if (/^[1-9]$/.test(event.key) && items[Number(event.key) - 1]) items[Number(event.key) - 1].click();
    else return false;
    return true;
  }

  // --- the report ---------------------------------------------------------------------------------------------------
  const openReport = () => {
    if (!state || !state.is_on || busy) return;
    point(null);
    at("report-form").reset();
    report.showModal();
    report.querySelector("input").focus();
  };
  at("open-report").onclick = openReport;
  at("cancel").onclick = () => report.close();
  at("report-form").onsubmit = () => {
    const status = new FormData(at("report-form")).get("status");
    reply("report", { status, summary: at("summary").value });
  };

  // --- keys ---------------------------------------------------------------------------------------------------------
  const KEYS = {
    ArrowUp: MOVES.forward, w: MOVES.forward, ArrowDown: MOVES.backward, s: MOVES.backward,
    ArrowLeft: MOVES.turn_left, a: MOVES.turn_left, ArrowRight: MOVES.turn_right, d: MOVES.turn_right,
    r: MOVES.look_up, f: MOVES.look_down, q: drop, e: openReport,
    c: () => {
      point([320, 240]);
      pointing = true;
    },
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || report.open || !state || !state.is_on) return;
    if (event.key === "Escape") {
      point(null);
      return;
    }
    let done = false;
    if (!menu.hidden) done = menuKey(event);
    else if (event.target.tagName === "INPUT" || event.target.tagName === "SUMMARY") return;
    else if (pointing) done = pointByKeys(event);
    if (!done && menu.hidden && KEYS[event.key] && !(event.repeat && busy)) {
      KEYS[event.key]();
      done = true;
    }
    if (done) event.preventDefault();
  });
  for (const button of document.querySelectorAll("[data-do]")) button.onclick = MOVES[button.dataset.do];
  at("drop").onclick = drop;
  at("begin").onclick = () => ask("/next", {});
  ask("/state");
})();
