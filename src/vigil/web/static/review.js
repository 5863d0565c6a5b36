"use strict";
// The reviewer's page.
(() => {
  const at = (id) => document.getElementById(id);
  const data = JSON.parse(at("data").textContent);
  let now = 1;
  let timer = null;
  let writing = null;

  function go(step) {
    now = Math.min(Math.max(step, 1), data.steps.length);
    const { words, click } = data.steps[now - 1];
    at("picture").src = `${data.url}/solution/${now}.png`;
    at("step").textContent = `step ${now} of ${data.steps.length}: ${words}`;
    at("clicks").replaceChildren();
    for (const kind of click ? ["click-ring", "click-core"] : []) {
      const ring = document.createElementNS("http://www.w3.org/2000/svg", "circle");
      for (const [name, value] of Object.entries({ cx: click[0], cy: click[1], r: 14, class: kind })) ring.setAttribute(name, value);
      at("clicks").append(ring);
    }
    for (const button of at("strip").querySelectorAll("button")) {
      if (Number(button.dataset.step) === now) button.setAttribute("aria-current", "step");
      else button.removeAttribute("aria-current");
    }
    document.documentElement.dataset.step = now;
  }
  data.steps.forEach(({ words }, index) => {
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.step = index + 1;
    button.textContent = `${index + 1} ${words}`;
    button.onclick = () => go(index + 1);
    item.append(button);
    at("strip").append(item);
  });
  at("picture").onerror = () => {
    at("no-frame").textContent = "This picture cannot be drawn.";
    at("no-frame").hidden = false;
  };
  at("picture").onload = () => {
    at("no-frame").hidden = true;
  };

  function play(on) {
    clearInterval(timer);
    timer = null;
    if (on) {
      if (now >= data.steps.length) go(1);
      timer = setInterval(() => (now >= data.steps.length ? play(false) : go(now + 1)), 900);
    }
    at("play").textContent = timer ? "Stop" : "Play";
  }

  for (let turn = 0; turn < data.around; turn += 1) {
    const image = document.createElement("img");
    image.src = `${data.url}/around/${turn}.png`;
    image.alt = `turned by ${(turn * 360) / data.around} degrees`;
    image.width = 160;
    image.height = 120;
    image.loading = "lazy";
    const place = document.createElement("span");
    place.className = "drawn";
    place.append(image);
    at("around").append(place);
  }
  for (const node of document.querySelectorAll(".plan [data-id]")) if (data.ids.includes(node.dataset.id)) node.classList.add("found");

  async function say(said, moves) {
    at("said").textContent = "…";
    try {
      const answer = await fetch(`${data.url}/verdict`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(said) });
      const found = await answer.json();
      if (!answer.ok) throw new Error(found.error ?? "The server did not accept the verdict.");
      at("judgement").textContent = found.judgement ?? "none yet";
      at("judgement").className = `tag ${found.judgement === "approve" ? "good" : found.judgement === "reject" ? "bad" : ""}`;
      if (found.instruction) at("instruction").textContent = found.instruction;
      if (found.target_size) at("target-size").textContent = found.target_size;
      at("notes").replaceChildren(
        ...found.notes.map((text) => {
          const item = document.createElement("li");
          item.textContent = text;
          return item;
        }),
      );
      at("said").textContent = `Saved: ${said.verdict}.`;
      document.documentElement.dataset.saved = Number(document.documentElement.dataset.saved ?? 0) + 1;
      if (moves && data.after) setTimeout(() => at("after").click(), 350);
    } catch (error) {
      at("said").textContent = `NOT saved: ${error.message}`;
    }
  }

  function write(kind) {
    writing = kind;
    at("words-label").textContent = { reject: "Why is it rejected?", edit: "New wording", note: "Note" }[kind];
    at("words").value = kind === "edit" ? at("instruction").textContent : "";
    at("form").hidden = false;
    at("words").focus();
  }
  const stop = () => {
    writing = null;
    at("form").hidden = true;
    at("words").blur();
  };
  at("form").onsubmit = (event) => {
    event.preventDefault();
    const text = at("words").value.trim();
    if (writing === "edit") say({ verdict: "edit", instruction: text });
    else say({ verdict: writing, text }, writing === "reject");
    stop();
  };
  at("cancel").onclick = stop;

  const leave = (id) => at(id) && at(id).click();
  const KEYS = {
    ArrowLeft: () => go(now - 1),
    ArrowRight: () => go(now + 1),
    " ": () => play(!timer),
    a: () => say({ verdict: "approve" }, true),
    x: () => write("reject"),
    e: () => write("edit"),
    n: () => write("note"),
    1: () => say({ verdict: "target_size", target_size: "large" }),
    2: () => say({ verdict: "target_size", target_size: "medium" }),
    3: () => say({ verdict: "target_size", target_size: "small" }),
    j: () => leave("after"),
    k: () => leave("before"),
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.tagName === "TEXTAREA") {
      if (event.key === "Escape") stop();
      if (event.key === "Enter" && !event.shiftKey) {
        event.preventDefault();
        at("form").requestSubmit();
      }
      return;
    }
    if (event.key === " " && event.target.tagName === "BUTTON") return;
    const act = KEYS[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
  at("back").onclick = KEYS.ArrowLeft;
  at("next").onclick = KEYS.ArrowRight;
  at("play").onclick = KEYS[" "];
  for (const id of ["approve", "reject", "edit", "note"]) at(id).onclick = KEYS[{ approve: "a", reject: "x", edit: "e", note: "n" }[id]];
  for (const button of document.querySelectorAll("[data-size]")) button.onclick = () => say({ verdict: "target_size", target_size: button.dataset.size });
  go(1);
})();
