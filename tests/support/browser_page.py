"""Visitor of the pages: a browser page that collects errors, and the checks that every page must pass."""

from typing import Any

from axe_playwright_python.base import AXE_SCRIPT

DESKTOP, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
CONTRAST = """() => {
  const parse = (text) => {
    const found = text.match(/[\\d.]+/g).map(Number);
    const scaled = text.startsWith("color(") ? [...found.slice(0, 3).map((v) => v * 255), ...found.slice(3)] : found;
    return scaled.length < 4 ? [...scaled, 1] : scaled;
  };
  const light = (rgb) => {
    const [r, g, b] = rgb.map((v) => (v / 255 <= 0.03928 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const hidden = "svg, script, .vh, .skip, :disabled";
  const faults = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.textContent.trim();
    const node = walker.currentNode.parentElement;
    if (!text || !node.checkVisibility() || node.closest(hidden)) continue;
    let under = node;
    while (under && parse(getComputedStyle(under).backgroundColor)[3] < 0.5) under = under.parentElement;
    const back = light(parse(getComputedStyle(under ?? document.documentElement).backgroundColor));
    const fore = light(parse(getComputedStyle(node).color));
    const ratio = (Math.max(back, fore) + 0.05) / (Math.min(back, fore) + 0.05);
    if (ratio < 4.5) faults.push(`${node.tagName}.${node.className} "${text.slice(0, 30)}" ${ratio.toFixed(2)}`);
  }
  return faults;
}"""
UNSEEN_FOCUS = """() => {
  const node = document.activeElement;
  if (!node || node === document.body) return "";
  const piece = node.matches("svg a") ? node.querySelector("rect") : null;
  const shown = getComputedStyle(piece ?? node);
  const width = parseFloat(piece ? shown.strokeWidth : shown.outlineStyle === "none" ? "0" : shown.outlineWidth);
  return width >= 2.5 ? "" : node.outerHTML.slice(0, 120);
}"""
NAMELESS = """() => [...document.querySelectorAll("button, a[href]")]
  .filter((node) => !node.textContent.trim() && !node.ariaLabel).length"""


class Visitor:
    """A browser page with all errors that occurred on it."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.faults: list[str] = []
        page.on("console", lambda message: self.faults.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: self.faults.append(str(error)))

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.keyboard.press(key)

    def tab_to(self, selector: str, most: int = 120) -> None:
        """Go to an element with the Tab key only; each stop on the way must have a visible focus."""
        for _ in range(most):
            self.press("Tab")
            assert self.page.evaluate(UNSEEN_FOCUS) == ""
            if self.page.evaluate("(wanted) => document.activeElement.matches(wanted)", selector):
                return
        raise AssertionError(f"{selector} is not among the first {most} stops of the Tab key")

    def has(self, selector: str) -> None:
        self.page.wait_for_selector(selector, state="attached")

    def text(self, selector: str) -> str:
        return self.page.text_content(selector).strip()

    def check(self, where: str) -> None:
        """Assert: no errors, nothing wider than the window, legible text, named controls, no script of a model ran."""
        assert self.faults == [], where
        width = self.page.viewport_size["width"]
        assert self.page.evaluate("document.documentElement.scrollWidth") <= width, where
        assert self.page.evaluate(CONTRAST) == [], where
        assert self.page.evaluate("typeof window.evil") == "undefined", where
        assert self.page.evaluate(NAMELESS) == 0, where

    def check_with_axe(self, where: str) -> None:
        """Assert that axe-core, which checks accessibility, finds no violation on the page."""
        self.page.evaluate(AXE_SCRIPT)
        found = self.page.evaluate("axe.run()")["violations"]
        assert [(each["id"], each["nodes"][0]["html"]) for each in found] == [], where
