"use strict";
// A page that follows a run that goes on: what is new is asked for and put in place. Nodes that stay keep focus, scroll
// and what was chosen; nothing is asked for once the run has ended, or while nobody looks.
(() => {
  const live = document.getElementById("live");
  if (!live) return;
  const WAIT_MS = { "in progress": 2000, "not ended": 10000, interrupted: 10000 };
  const QUIET_S = 600; // nothing new for so long is worth a warning
  const THEIRS = new Set(["open", "checked"]); // attributes that a reader may have changed
  let heard = Date.now();

  const keyOf = (node) => node.dataset?.key;
  const has = (node) => node.contains(document.activeElement);

  // Makes `old` what `fresh` is, node by node; those with a key are matched by it, others by their place.
  function renew(old, fresh) {
    if (old.nodeType !== Node.ELEMENT_NODE) {
      if (old.data !== fresh.data) old.data = fresh.data;
      return;
    }
    for (const { name, value } of fresh.attributes) if (!THEIRS.has(name) && old.getAttribute(name) !== value) old.setAttribute(name, value);
    for (const { name } of [...old.attributes]) if (!THEIRS.has(name) && !fresh.hasAttribute(name)) old.removeAttribute(name);
    const known = new Map([...old.children].map((child) => [keyOf(child), child]));
    let at = old.firstChild;
    const takeOut = () => {
      const gone = at;
      at = at.nextSibling;
      gone.remove();
    };
    for (const next of [...fresh.childNodes]) {
      const key = keyOf(next);
      const alike = at && !keyOf(at) && at.nodeName === next.nodeName ? at : undefined;
      const mine = key ? known.get(key) : alike;
      if (!mine) {
        old.insertBefore(next, at);
        continue;
      }
      if (mine !== at && !has(mine)) old.insertBefore(mine, at);
      else while (at !== mine) takeOut(); // the others move, not the one with the focus
      if (mine === at) at = at.nextSibling;
      renew(mine, next);
    }
    while (at) {
      if (has(at)) at = at.nextSibling;
      else takeOut();
    }
  }

  const ago = (seconds) => {
    const [size, name] = [[86400, "d"], [3600, "h"], [60, "min"], [1, "s"]].find(([size]) => seconds >= size) ?? [1, "s"];
    return `${Math.floor(seconds / size)} ${name} ago`;
  };

  // How long ago the last row was written, and what is new below.
  function tell() {
    for (const node of live.querySelectorAll("[data-since]")) {
      const seconds = Math.max(0, Math.floor(Date.now() / 1000 - Number(node.dataset.since)));
      node.textContent = `(${ago(seconds)})`;
      node.classList.toggle("warn", seconds > QUIET_S);
    }
    const more = document.getElementById("more");
    if (!more) return;
    const count = Number(live.dataset.scored) - Number(more.dataset.listed);
    more.hidden = count <= 0;
    document.getElementById("more-count").textContent = count === 1 ? "1 new episode" : `${count} new episodes`;
  }

  function unheard(message) {
    const node = document.getElementById("unheard");
    if (!node) return;
    node.textContent = message;
    node.hidden = !message;
  }

  async function ask() {
    const answer = await fetch(live.dataset.url, { headers: { "If-None-Match": live.dataset.tag, Accept: "text/html" } });
    if (answer.status === 304) return;
    if (!answer.ok) throw new Error(`The server answers with ${answer.status}.`);
    const fresh = new DOMParser().parseFromString(await answer.text(), "text/html").getElementById("live");
    if (fresh) renew(live, fresh);
  }

  async function follow() {
    if (document.visibilityState === "visible") {
      try {
        await ask();
        heard = Date.now();
        unheard("");
      } catch {
        unheard(`· no answer from the server for ${Math.floor((Date.now() - heard) / 1000)} s; this page may be outdated`);
      }
      tell();
      document.documentElement.dataset.asked = Number(document.documentElement.dataset.asked ?? 0) + 1;
    }
    later();
  }

  function later() {
    const wait = WAIT_MS[live.dataset.state];
    if (wait) setTimeout(follow, wait);
  }

  tell();
  later();
})();
