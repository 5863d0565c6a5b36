"use strict";
// A walk through a house.
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const at = (id) => document.getElementById(id);
  const url = at("walk").dataset.url;
  const plan = document.querySelector(".plan");
  const overlay = plan.querySelector(".overlay");
  let pose = JSON.parse(at("start").textContent);
  let busy = false;

  const ACTIONS = {
    ArrowUp: { skill_name: "navigate", mode: "forward", magnitude: 1 },
    ArrowDown: { skill_name: "navigate", mode: "backward", magnitude: 1 },
    ArrowLeft: { skill_name: "navigate", mode: "turn_left", magnitude: 30 },
    ArrowRight: { skill_name: "navigate", mode: "turn_right", magnitude: 30 },
    r: { skill_name: "look", direction: "up", magnitude: 15 },
    f: { skill_name: "look", direction: "down", magnitude: 15 },
  };
  Object.assign(ACTIONS, { w: ACTIONS.ArrowUp, s: ACTIONS.ArrowDown, a: ACTIONS.ArrowLeft, d: ACTIONS.ArrowRight });

  async function ask(path, body) {
    const answer = await fetch(url + path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
    const found = await answer.json();
    if (!answer.ok) throw new Error(found.error ?? "This place cannot be shown.");
    return found;
  }

  function stand() {
    overlay.replaceChildren();
    const [x, , z] = pose.position;
    const add = (name, attributes) => {
      const node = document.createElementNS(SVG, name);
      for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
      overlay.append(node);
    };
    const side = (deg) => {
      const angle = ((pose.rotation + deg) * Math.PI) / 180;
      return `${x + 0.9 * Math.sin(angle)},${-z - 0.9 * Math.cos(angle)}`;
    };
    add("path", { class: "cone", d: `M ${x},${-z} L ${side(-53)} A 0.9 0.9 0 0 1 ${side(53)} Z` });
    add("circle", { class: "agent", cx: x, cy: -z, r: 0.14 });
  }

  async function walk(action, from = pose) {
    if (busy) return;
    busy = true;
    try {
      const seen = await ask("/walk", { pose: from, action });
      pose = seen.pose;
      at("picture").src = seen.frame;
      at("no-frame").hidden = true;
      at("said").textContent = seen.blocked ? `Blocked${seen.by ? ` by ${seen.by}` : ""}.` : "Click on the picture to see an object's name.";
      stand();
    } catch (error) {
      if (at("picture").src) {
        at("said").textContent = error.message;
      } else {
        at("no-frame").textContent = error.message;
        at("no-frame").hidden = false;
      }
    }
    busy = false;
    document.documentElement.dataset.moves = Number(document.documentElement.dataset.moves ?? 0) + 1;
  }

  function find(id) {
    for (const node of plan.querySelectorAll(".found")) node.classList.remove("found");
    const node = [...plan.querySelectorAll("[data-id]")].find((each) => each.dataset.id === id);
    if (node) node.classList.add("found");
  }

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "INPUT") return;
    const action = ACTIONS[event.key];
    if (!action) return;
    event.preventDefault();
    walk(action);
  });
  for (const button of document.querySelectorAll("[data-key]")) button.onclick = () => walk(ACTIONS[button.dataset.key]);
  at("picture").onclick = async (event) => {
    const box = event.target.getBoundingClientRect();
    const x = Math.min(639, Math.floor(((event.clientX - box.left) / box.width) * 640));
    const y = Math.min(479, Math.floor(((event.clientY - box.top) / box.height) * 480));
    const { id } = await ask("/name", { pose, x, y });
    at("said").textContent = id ?? "There is no object, only the house itself.";
    find(id);
  };
  plan.onclick = (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(plan.getScreenCTM().inverse());
    walk(null, { ...pose, position: [point.x, pose.position[1], -point.y] });
  };
  at("find").oninput = (event) => {
    const word = event.target.value.toLowerCase();
    for (const row of document.querySelectorAll("#things tbody tr")) row.hidden = !row.textContent.toLowerCase().includes(word);
  };
  for (const button of document.querySelectorAll("#things button")) button.onclick = () => {
    find(button.dataset.id);
    plan.scrollIntoView({ block: "nearest" });
  };
  walk(null);
})();
