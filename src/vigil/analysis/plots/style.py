"""Style of figures: a palette that works for colour-blind readers and in greyscale, on an opaque light background.

The background is opaque so that a figure looks the same on a dark page.
"""

import io
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Literal

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from vigil.base.markup import replace_invalid

GROUND = "#fbfaf7"
INK = "#23262b"
FAINT = "#8b9098"
GRID = "#dfdfdb"
GREY = "#a9adb3"
LABEL_COLOURS = {"B": "#009e73", "FR": "#d55e00", "Other": "#f0c04a", "NR": "#0072b2", "IL": "#555b66"}
_PALE = ("#f0c04a", "#56b4e9", "#e69f00")
LABEL_LOOKS = {
    "B: verified success": (LABEL_COLOURS["B"], ""),
    "FR: false report": (LABEL_COLOURS["FR"], "////"),
    "Other: matched, W=0": (LABEL_COLOURS["Other"], "...."),
    "NR: no report": (LABEL_COLOURS["NR"], "\\\\\\\\"),
    "IL: invalid limit": (LABEL_COLOURS["IL"], "xxxx"),
}
"""Name of a label -> colour and hatch, in the order of the stacked bars."""
KIND_LOOKS = {
    "navigate": ("#0072b2", ""),
    "look": ("#56b4e9", "...."),
    "interact_pixel": ("#e69f00", "////"),
    "report": ("#009e73", ""),
    "invalid": ("#555b66", "xxxx"),
}
"""Kind of action -> colour and hatch."""
GROUP_MARKERS = {
    "Embodied / robotics-tuned": "s",
    "Open general and reasoning VLMs": "o",
    "Closed-source frontier": "D",
    "Scripted agents": "^",
    "People": "*",
    "Privileged agents (they see hidden state)": "P",
}
OTHER_MARKER = "v"
"""Marker of groups that are named only in a study's file."""
CYCLE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#555b66", "#8c564b")
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (3, 1)), (0, (1, 1)), (0, (8, 2)))
DPI = 160

_SETTINGS: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": GROUND,
    "figure.facecolor": GROUND,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "grid.color": GRID,
    "hatch.linewidth": 0.6,
    "hatch.color": "#ffffff",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "svg.hashsalt": "vigil",
    "pdf.fonttype": 42,
    "savefig.facecolor": GROUND,
}


_ON_PAPER: dict[Any, Any] = dict.fromkeys(("axes.facecolor", "figure.facecolor", "savefig.facecolor"), "white")
PLOT_WIDTH_IN = 8.6
"""Width (inches) of figures that show numbers. The width of a figure with frames depends on the number of frames."""
MIN_HEIGHT_SCALE = 0.85
"""Smallest factor on the height of a figure that is scaled down for a paper, so that rows do not overlap."""
PaperWidth = Literal["page", "column"]
PAPER_WIDTHS_IN: dict[PaperWidth, float] = {"page": 6.75, "column": 3.25}
"""Widths (inches) of a page's text and of a column in a paper of two columns."""
MIN_POINTS = 6.0
"""Smallest size (points) of text in a figure, at the width at which the figure is printed."""
_TEXT_SCALES: dict[PaperWidth | None, float] = {None: 1.0, "page": 0.85, "column": 0.75}
_paper_width: ContextVar[PaperWidth | None] = ContextVar("paper_width", default=None)


@contextmanager
def on_paper(width: PaperWidth | None) -> Generator[None, None, None]:
    """Draw figures inside the block for a paper: on white, as wide as they are printed, and without titles.

    If `width` is None, figures are drawn for a screen.
    """
    token = _paper_width.set(width)
    try:
        yield
    finally:
        _paper_width.reset(token)


def paper_width_in() -> float | None:
    """Return the width (inches) at which a figure is printed; None if it is drawn for a screen."""
    width = _paper_width.get()
    return None if width is None else PAPER_WIDTHS_IN[width]


def is_column() -> bool:
    """Return whether figures are drawn for one column of a paper."""
    return _paper_width.get() == "column"


def text_pt(size: float) -> float:
    """Return the size (points) of a text whose size on a screen is `size`. For a paper, texts are scaled."""
    return max(MIN_POINTS, size * _TEXT_SCALES[_paper_width.get()])


def set_figure_title(axes: Axes, text: str) -> None:
    """Write a title over the only axes of a figure, unless it is for a paper, where the caption is the title."""
    if _paper_width.get() is None:
        axes.set_title(text)


@contextmanager
def styled() -> Generator[None, None, None]:
    """Apply the project's style inside the block, and restore matplotlib's settings afterwards."""
    sizes = {name: text_pt(value) for name, value in _SETTINGS.items() if name.endswith("size")}
    with mpl.rc_context(_SETTINGS | sizes | (_ON_PAPER if _paper_width.get() else {})):
        yield


def canvas(width: float, height: float, *, is_free: bool = False) -> Figure:
    """Return an empty figure of that size (inches) without a window; `is_free` leaves the layout to the caller."""
    printed = paper_width_in()
    scale = printed / width if printed is not None and width == PLOT_WIDTH_IN else 1.0
    figure = Figure(
        figsize=(scale * width, max(scale, MIN_HEIGHT_SCALE) * height), layout=None if is_free else "constrained"
    )
    FigureCanvasAgg(figure)
    return figure


def figure_bytes(figure: Figure, kind: str) -> bytes:
    """Return a figure as the bytes of a png, svg or pdf file. The same figure gives the same bytes."""
    buffer = io.BytesIO()
    dates = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    for text in figure.findobj(Text):  # remove the characters that fonts or files cannot represent
        said = text.get_text()
        clean = replace_invalid(said).replace("\t", " ").replace("\r", " ")
        if clean != said:
            text.set_text(clean)
    with styled():
        if (engine := figure.get_layout_engine()) is not None:
            engine.execute(figure)  # lays out the figure once; otherwise each file would do so again
            figure.set_layout_engine(None)
        figure.savefig(buffer, format=kind, dpi=DPI, metadata=dates[kind])
    written = buffer.getvalue()
    return (
        replace_invalid(written.decode()).encode() if kind == "svg" else written
    )  # labels of axes are created during drawing


def ink_on(colour: str) -> str:
    """Return a colour for text that is legible on a background of `colour`."""
    return INK if colour in _PALE else "white"


def ink_of(colour: str) -> str:
    """Return `colour` if text in this colour is legible on paper, else INK."""
    return INK if colour in _PALE else colour
