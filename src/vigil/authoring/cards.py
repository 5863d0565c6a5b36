"""Cards: README files for folders that are written to be shared, made from the templates in `templates`."""

from collections.abc import Iterable, Sequence
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

CARD = "README.md"
_TEMPLATES = Environment(
    loader=PackageLoader("vigil.authoring"),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)


def render_card(template: str, **facts: Any) -> str:
    """Return the text of a card; `template` is the name of a file in `templates`, without `.md`."""
    return _TEMPLATES.get_template(f"{template}.md").render(facts)


def table_lines(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a Markdown table."""
    lines = [f"| {' | '.join(row)} |" for row in (heads, *rows)]
    return [lines[0], f"|{'---|' * len(heads)}", *lines[1:]]


def rate_words(share: float, interval: tuple[float, float]) -> str:
    """Return a rate and its interval in percent, e.g. `61.3 [50, 71]`."""
    low, high = interval
    return f"{100 * share:.1f} [{100 * low:.0f}, {100 * high:.0f}]"
