"""Cards: README files for folders that are written to be shared, made from the templates in `templates`."""

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
