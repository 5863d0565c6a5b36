"use strict";
// The trajectory viewer. Everything that a model wrote is put in as text, never as HTML.
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const SAME_PLACE_M = 0.05; // as in web/films/plan.py: a thing whose box begins and ends so near to its outline has not been moved
  const timeline = JSON.parse(document.getElementById("timeline").textContent);
  const at = (id) => document.getElementById(id);
  const count = timeline.steps.length;
  const kept = new Map();
  const notes = new Map();
  let now = 1;
  let timer = null;

  const shape = (name, attributes, parent, text) => {
    const node = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    parent.append(node);
    return node;
  };
  const line = (id, text) => {
    at(id).textContent = text ?? "";
    at(`${id}-line`).hidden = text === null || text === undefined || text === "";
  };

  function picture(step) {
    if (!kept.has(step)) {
      const image = new Image();
      image.src = timeline.frames[step - 1];
      kept.set(step, image);
    }
    return kept.get(step);
  }

  // Where a frame comes from, and whether it is the recorded one; asked for when the picture has come.
  async function noteOf(step) {
    if (timeline.frame_notes) return timeline.frame_notes[step - 1];
    const answer = await fetch(timeline.frames[step - 1].replace(/png$/, "json"), { headers: { Accept: "application/json" } });
    const found = await answer.json();
    return answer.ok ? found : { is_recorded: null, note: found.error };
  }

  async function say(step, isDrawn) {
    if (!notes.has(step)) {
      try {
        notes.set(step, await noteOf(step));
      } catch {
        notes.set(step, { is_recorded: null, note: "The server does not answer." });
      }
    }
    if (step !== now) return;
    const { is_recorded, note } = notes.get(step);
    at("frame-note").textContent = isDrawn ? note : "";
    at("frame-note").classList.toggle("warn", is_recorded === false);
    at("no-frame").textContent = note;
    at("no-frame").hidden = isDrawn;
    document.documentElement.dataset.noted = step;
  }

  function showFrame(step) {
    const image = picture(step.index);
    const shown = at("picture");
    at("no-frame").hidden = true;
    shown.hidden = !image.getAttribute("src");
    if (!shown.hidden) shown.src = image.src;
    image.decode().then(
      () => say(step.index, true),
      () => say(step.index, false),
    );
    const clicks = at("clicks");
    clicks.replaceChildren();
    if (!step.click) return;
    const [x, y] = step.click;
    shape("circle", { cx: x, cy: y, r: 14, class: "click-ring" }, clicks);
    shape("circle", { cx: x, cy: y, r: 14, class: "click-core" }, clicks);
    shape("circle", { cx: x, cy: y, r: 2, class: "click-core" }, clicks);
    const left = x > 470;
    shape("text", { x: left ? x - 20 : x + 20, y: Math.max(20, y + 6), class: "click-text", "text-anchor": left ? "end" : "start" }, clicks, step.intent.replaceAll("_", " "));
  }

  function showStep(step) {
    at("action").textContent = step.action;
    const tag = at("validity");
    tag.textContent = step.invalid ? step.invalid.kind.replaceAll("_", " ") : "valid";
    tag.className = step.invalid ? "tag bad" : "tag good";
    line("thought", step.thought);
    line("summary", step.summary);
    line("state", step.cognitive_state);
    const facts = [];
    if (step.invalid && step.invalid.detail) facts.push(step.invalid.detail);
    if (step.invalid && step.invalid.would_parse_leniently) facts.push("the lenient policy would have read it");
    if (step.finish_reason) facts.push(`finished: ${step.finish_reason}`);
    if (step.reasoning_chars) facts.push(`${step.reasoning_chars} characters of reasoning`);
    if (step.tokens) facts.push(`${step.tokens[0]} + ${step.tokens[1]} tokens`);
    if (step.seconds) facts.push(`${step.seconds.toFixed(1)} s`);
    at("facts").textContent = facts.join(" · ");
    at("reply").textContent = step.reply;
    at("reasoning").textContent = step.reasoning;
    at("reasoned").hidden = !step.reasoning;
  }

  // --- hidden state -------------------------------------------------------------------------------------------------
  const hidden = timeline.hidden;
  const fact = (list, name, value) => {
    const term = document.createElement("dt");
    term.textContent = name;
    const text = document.createElement("dd");
    text.textContent = value;
    list.append(term, text);
  };

  function showVerdict() {
    const box = at("verdict");
    box.replaceChildren();
    const verdict = hidden.verdict;
    const head = document.createElement("p");
    head.className = "head";
    const rule = verdict && verdict.subtype ? ` (${verdict.subtype.replaceAll("_", " ")})` : "";
    head.textContent = verdict ? `${verdict.label ? `${verdict.label}${rule} · ${verdict.category} · ` : ""}W\u00a0${verdict.W ? 1 : 0} · W\u00a0strict\u00a0${verdict.W_strict ? 1 : 0} · B\u00a0${verdict.B === null ? "–" : verdict.B ? 1 : 0}` : "No verdict: an error is never scored.";
    box.append(head);
    if (verdict && verdict.label) box.classList.add(verdict.label);
    for (const text of verdict ? verdict.why : []) {
      const why = document.createElement("p");
      why.textContent = text;
      box.append(why);
    }
    at("goal").textContent = `Goal: ${hidden.goal}. Budget ${hidden.max_steps} steps, ${hidden.max_invalid} invalid actions.`;
  }

  function showNow(step) {
    const list = at("now");
    list.replaceChildren();
    const world = hidden.worlds[now];
    const row = hidden.rows[now];
    if (step) fact(list, "what the action did", step.hidden.effect || "–");
    if (row) {
      const progress = row.progress === null ? "" : `, progress ${row.progress.toFixed(2)}`;
      fact(list, "goal after this step", `${row.W ? "it holds" : "it does not hold"}${row.strict ? ", also strictly" : ""}${progress}`);
    }
    if (hidden.first_row !== null) fact(list, "goal first held", hidden.first_row === 0 ? "at the start" : `after step ${hidden.first_row}`);
    if (!world) return;
    if (world.distance_m !== null) fact(list, "target after this step", `${world.distance_m.toFixed(2)} m away, ${world.visible_px} px in view`);
    if (world.held) fact(list, "in hand after this step", world.held);
    const stood = hidden.worlds[now - 1];
    fact(list, "camera before this step", `x ${stood.x.toFixed(2)}, z ${(-stood.y).toFixed(2)}, heading ${stood.yaw.toFixed(0)}°, pitch ${stood.horizon.toFixed(0)}°`);
  }

  function showProgress() {
    const chart = at("progress");
    chart.replaceChildren();
    const rows = hidden.rows;
    if (!rows.length) return;
    const x = (index) => 34 + (rows.length > 1 ? (index / (rows.length - 1)) * 554 : 0);
    const y = (value) => 96 - value * 84;
    for (const value of [0, 0.5, 1]) {
      shape("line", { x1: 34, x2: 588, y1: y(value), y2: y(value), class: "axis" }, chart);
      shape("text", { x: 28, y: y(value) + 4, "text-anchor": "end" }, chart, String(value));
    }
    rows.forEach((row, index) => {
      if (row.W) shape("rect", { x: x(index) - 2, y: 12, width: Math.max(4, index + 1 < rows.length ? x(index + 1) - x(index) : 4), height: 84, class: "held" }, chart);
    });
    if (rows.some((row) => row.progress !== null)) {
      shape("polyline", { class: "curve", points: rows.map((row, index) => `${x(index)},${y(row.progress ?? 0)}`).join(" ") }, chart);
    } else {
      shape("text", { x: 311, y: 44, "text-anchor": "middle" }, chart, "no progress is measured for this goal");
    }
    for (const framing of ["state", "doubt"]) {
      const answers = hidden.beliefs.filter((each) => each.framing === framing);
      const points = answers.map((each) => [x(each.step - 1), y(each.sure / 20)]);
      shape("polyline", { class: `belief ${framing}`, points: points.map((point) => point.join(",")).join(" ") }, chart);
      points.forEach(([cx, cy], index) => {
        const { step, sure, done } = answers[index];
        shape("title", {}, shape("circle", { class: `belief ${framing}`, cx, cy, r: 4 }, chart), `frame ${step}, ${framing}: ${done ? "done" : "not done"}, ${sure} of 20`);
      });
    }
    shape("line", { x1: x(now), x2: x(now), y1: 8, y2: 98, class: "now" }, chart);
    shape("text", { x: 34, y: 114 }, chart, "start");
    at("progress-words").textContent = [
      "Line: progress of the goal",
      hidden.beliefs.length ? "dots: stated likelihood that the task is done, at the frame before each step" : "",
      hidden.beliefs.some((each) => each.framing === "doubt") ? "yellow-brown dots: asked what could be wrong" : "",
      rows.some((row) => row.W) ? "green: the goal holds" : "",
      "upright line: after this step",
    ].filter(Boolean).join("; ") + ".";
    shape("text", { x: 588, y: 114, "text-anchor": "end" }, chart, `step ${rows.length - 1}`);
  }

  function isSamePlace(one, other) {
    const sides = (box) => [box.x, box.y, box.x + box.width, box.y + box.height];
    return sides(one).every((side, index) => Math.abs(side - sides(other)[index]) < SAME_PLACE_M);
  }

  function showPlan() {
    const layer = document.querySelector("#hidden .plan .overlay");
    if (!layer || !hidden.worlds.length) return;
    layer.replaceChildren();
    const world = hidden.worlds[Math.min(now - 1, hidden.worlds.length - 1)];
    for (const [name, state] of Object.entries(world.objects)) {
      if (state.is_held) continue;
      const box = shape("polygon", { points: state.corners, class: "target" }, layer);
      const drawn = document.querySelector(`#hidden .plan [data-id="${CSS.escape(name)}"][points]`);
      if (drawn && isSamePlace(drawn.getBBox(), box.getBBox())) box.setAttribute("points", drawn.getAttribute("points"));
      shape("title", {}, box, name);
    }
    const points = hidden.worlds.map((each) => `${each.x},${each.y}`);
    shape("polyline", { class: "path", points: points.join(" ") }, layer);
    shape("polyline", { class: "trod", points: points.slice(0, now).join(" ") }, layer);
    const reach = 0.9;
    const side = (deg) => {
      const angle = ((world.yaw + deg) * Math.PI) / 180;
      return `${world.x + reach * Math.sin(angle)},${world.y - reach * Math.cos(angle)}`;
    };
    const [left, right] = [side(-53), side(53)];
    shape("path", { class: "cone", d: `M ${world.x},${world.y} L ${left} A ${reach} ${reach} 0 0 1 ${right} Z` }, layer);
    shape("circle", { class: "agent", cx: world.x, cy: world.y, r: 0.14 }, layer);
  }

  // The list of chores, with each ticked off while it holds, and the hidden truth beside the claim.
  function showChores() {
    const table = at("chores");
    table.hidden = !hidden.chores.length;
    table.tBodies[0].replaceChildren();
    for (const [index, chore] of hidden.chores.entries()) {
      const row = table.tBodies[0].insertRow();
      const name = document.createElement("th");
      name.scope = "row";
      name.textContent = `${index + 1}. ${chore.words}`;
      row.append(name);
      const [held, holds] = [chore.rows[now], chore.rows.at(-1)];
      const truth = chore.answer ? `${chore.answer}, ${holds ? "seen" : "not seen, or changed"}` : holds ? "holds" : "does not hold";
      for (const text of [held ? "✓" : "–", truth, chore.claim ?? "no claims asked for"]) row.insertCell().textContent = text;
      row.classList.toggle("held", Boolean(held));
    }
  }

  function showHidden(step) {
    if (!at("reveal").checked) return;
    showNow(step);
    showChores();
    showProgress();
    showPlan();
  }

  // --- moving through the steps -------------------------------------------------------------------------------------
  function go(step) {
    now = Math.min(Math.max(step, 1), Math.max(count, 1));
    at("place").textContent = count ? `step ${now} of ${count}` : "no steps";
    at("scrub").value = now;
    for (const button of at("strip").querySelectorAll("button")) {
      const here = Number(button.dataset.step) === now;
      if (here) button.setAttribute("aria-current", "step");
      else button.removeAttribute("aria-current");
      if (here) at("strip").scrollTop = button.offsetTop - 40;
    }
    history.replaceState(null, "", `#step=${now}${at("reveal").checked ? "&hidden" : ""}`);
    const told = timeline.steps[now - 1];
    if (told) {
      showFrame(told);
      showStep(told);
    }
    showHidden(told);
    for (const near of [now + 1, now - 1, now + 2]) if (near >= 1 && near <= count) picture(near);
    document.documentElement.dataset.step = now;
  }

  function play(on) {
    clearInterval(timer);
    timer = null;
    if (on) {
      if (now >= count) go(1);
      timer = setInterval(() => (now >= count ? play(false) : go(now + 1)), Number(at("speed").value));
    }
    at("play").textContent = timer ? "Stop" : "Play";
    at("play").setAttribute("aria-pressed", String(Boolean(timer)));
  }

  function reveal(on) {
    at("reveal").checked = on;
    for (const part of document.querySelectorAll(".hidden-state")) part.hidden = !on;
    if (on) showVerdict();
    go(now);
  }

  const leave = (id) => {
    const link = at(id);
    if (link) link.click();
  };
  const KEYS = {
    ArrowLeft: () => go(now - 1),
    ArrowRight: () => go(now + 1),
    Home: () => go(1),
    End: () => go(count),
    " ": () => play(!timer),
    h: () => reveal(!at("reveal").checked),
    "[": () => leave("before"),
    "]": () => leave("after"),
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const tag = event.target.tagName;
    if (tag === "SELECT" || tag === "TEXTAREA" || (tag === "INPUT" && event.target.type === "text")) return;
    if (event.key === " " && (tag === "BUTTON" || tag === "INPUT" || tag === "SUMMARY" || tag === "A")) return;
    if (tag === "INPUT" && event.target.type === "range") return;
    const act = KEYS[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
  at("first").onclick = KEYS.Home;
  at("back").onclick = KEYS.ArrowLeft;
  at("next").onclick = KEYS.ArrowRight;
  at("last").onclick = KEYS.End;
  at("play").onclick = KEYS[" "];
  at("speed").onchange = () => timer && play(true);
  at("scrub").max = Math.max(count, 1);
  at("scrub").oninput = (event) => go(Number(event.target.value));
  at("reveal").onchange = (event) => reveal(event.target.checked);
  timeline.steps.forEach((step) => {
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.step = step.index;
    button.className = step.skill;
    button.textContent = `${step.index} ${step.skill === "invalid" ? "invalid" : step.action}`.slice(0, 40);
    button.onclick = () => go(step.index);
    item.append(button);
    at("strip").append(item);
  });
  const start = () => {
    const asked = /step=(\d+)/.exec(location.hash);
    now = asked ? Number(asked[1]) : 1;
    reveal(location.hash.includes("hidden"));
  };
  window.addEventListener("hashchange", start);
  start();
})();
