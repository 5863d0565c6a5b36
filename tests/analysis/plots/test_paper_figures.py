"""Figures on paper: text is legible at the printed width, stays inside the figure, and covers no other text."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text

from tests.analysis.plots.test_trajectory import AI, LONG, SHORT, SILENT
from tests.support.published_runs import EpisodeScript, Write, small_records
from vigil.analysis.measures.paper import paper
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import study
from vigil.analysis.plots.diagrams import CONTRACT, FamilyExample, pipeline_figure, protocol_figure
from vigil.analysis.plots.figures import FIGURES, figure_captions
from vigil.analysis.plots.planes import name_points
from vigil.analysis.plots.style import (
    MIN_POINTS,
    PAPER_WIDTHS_IN,
    PLOT_WIDTH_IN,
    PaperWidth,
    canvas,
    figure_bytes,
    on_paper,
    styled,
    text_pt,
)
from vigil.analysis.plots.trajectory import goal_words, trajectory_figure

WIDTHS: list[PaperWidth] = list(PAPER_WIDTHS_IN)


def texts_of(figure: Figure) -> list[Text]:
    figure.canvas.draw()
    return [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]


def assert_is_printable(figure: Figure, width: PaperWidth) -> None:
    assert figure.get_figwidth() == pytest.approx(PAPER_WIDTHS_IN[width])
    assert figure.get_facecolor()[:3] == (1.0, 1.0, 1.0)
    for text in texts_of(figure):
        assert float(text.get_fontsize()) >= MIN_POINTS, text
    box = figure.get_tightbbox()
    wide, high = figure.get_size_inches()
    assert box.x0 >= -0.02, box
    assert box.y0 >= -0.02, box
    assert box.x1 <= wide + 0.02, box
    assert box.y1 <= high + 0.02, box


@pytest.mark.parametrize("width", WIDTHS)
def test_figures_of_numbers_fit_their_width(write: Write, width: PaperWidth) -> None:
    plots = {
        "Some-Model-With-A-Long-Name-235B-A22B (T)": lambda family: EpisodeScript(family, True, "success"),
        "silent": lambda family: EpisodeScript(family, True, "NR"),
    }
    runs = read_runs([write(name.split()[0], small_records(plot)) for name, plot in plots.items()])
    found = study(runs)
    with on_paper(width):
        for name in ("outcome_partition", "belief_closure", "plane", "closure_curves"):
            figure = FIGURES[name](found)
            assert figure is not None, name
            assert_is_printable(figure, width)


@pytest.mark.parametrize("width", WIDTHS)
def test_trajectories_fit_their_width_and_mark_gaps(width: PaperWidth) -> None:
    with on_paper(width):
        figure = trajectory_figure(AI, [LONG, SHORT, SILENT])
        assert_is_printable(figure, width)
    said = [text.get_text() for text in texts_of(figure)]
    assert any("not shown)" in text for text in said)
    assert not any("goal" in axes.get_title(loc) for axes in figure.axes for loc in ("left", "center"))
    assert goal_words(LONG, held=True) in said


def test_the_pipeline_says_under_a_frame_what_holds_after_it() -> None:
    with on_paper("page"):
        figure = pipeline_figure(AI, LONG)
        assert_is_printable(figure, "page")
    (axes,) = figure.axes
    lowest = min(picture.get_window_extent().y0 for picture in axes.child_axes)
    marks = [text for text in axes.texts if text.get_text() == goal_words(LONG, held=True)]
    assert len(marks) == len(axes.child_axes)
    assert all(mark.get_window_extent().y1 < lowest for mark in marks)
    assert any(text.get_text().startswith("+") for text in axes.texts)


def test_the_protocol_on_paper_leaves_its_legend_to_the_caption() -> None:
    with on_paper("page"):
        figure = protocol_figure({"AI": FamilyExample(AI, LONG.frames[0], (320.0, 240.0))})
        assert_is_printable(figure, "page")
    said = " ".join(" ".join(text.get_text().split()) for text in texts_of(figure))
    assert f"at most {AI.max_steps} steps at most {AI.max_invalid} invalid replies" in said
    assert CONTRACT[:40] not in said
    assert CONTRACT[:40] in " ".join(text.get_text() for text in texts_of(protocol_figure({})))


def test_a_state_in_view_is_not_called_a_goal() -> None:
    asked = replace(SHORT, outcome=replace(SHORT.outcome, expected="on"))
    assert goal_words(SHORT, held=True) == "after it: goal met (hidden)"
    assert [goal_words(asked, held=held) for held in (True, False)] == [
        "after it: state in view",
        "after it: W=0",
    ]


def test_privileged_runs_are_marked_on_paper(write: Write) -> None:
    runs = read_runs([write("plain"), write("seeing", agent="seeing", kind="privileged")])
    found = study(runs)
    assert not any("‡" in caption for caption in figure_captions(found).values())
    with on_paper("page"):
        captions = figure_captions(found)
        figure = FIGURES["outcome_partition"](found)
    assert figure is not None
    assert all("‡" in caption for caption in captions.values())
    rows = [label.get_text().split("  ")[0] for label in figure.axes[0].get_yticklabels()]
    assert sorted(row.endswith("‡") for row in rows) == [False, True]
    assert "seeing (privileged)‡" in rows


def test_a_pdf_embeds_its_fonts() -> None:
    with on_paper("column"):
        content = figure_bytes(trajectory_figure(AI, [SHORT]), "pdf")
    assert content.count(b"/FontFile2") == content.count(b"/FontDescriptor /")  # matplotlib writes them uncompressed


def plane_of(places: np.ndarray, names: list[str], width: PaperWidth | None) -> tuple[Axes, list[str]]:
    with on_paper(width), styled():
        figure = canvas(PLOT_WIDTH_IN, 4.7)
        axes = figure.add_subplot()
        axes.plot(*places.T, "o")
        axes.set(xlim=(0, 100), ylim=(0, 100), xlabel="W")
        labels = [((w, b), name, "black", text_pt(8.5)) for (w, b), name in zip(places, names, strict=True)]
        name_points(axes, labels)
    return axes, axes.get_xlabel().splitlines()


@pytest.mark.parametrize("width", [None, *WIDTHS])
@pytest.mark.parametrize("is_crowded", [False, True])
def test_labels_of_22_models_cover_no_other_and_stay_inside(width: PaperWidth | None, is_crowded: bool) -> None:
    rows = paper().points()
    names = [model.name for model, _, _ in rows] + ["Another-Model-With-A-Long-Name (T)", "One-More-Model-400B-A17B"]
    places = np.array([*((w, b) for _, w, b in rows), (50.0, 49.0), (51.0, 48.0)])
    assert len(names) >= 22
    axes, under = plane_of(places / (20 if is_crowded else 1) + (10 if is_crowded else 0), names, width)
    axes.get_figure().canvas.draw()  # pyright: ignore[reportOptionalMemberAccess]
    labels = [text for text in axes.texts if isinstance(text, Annotation) and text.get_text()]
    boxes = [Text.get_window_extent(text) for text in labels]
    inside = axes.get_window_extent().padded(1.0)  # pixels: the extent of a text is rounded when it is drawn
    assert all(inside.x0 <= box.x0 and box.x1 <= inside.x1 for box in boxes)
    assert all(inside.y0 <= box.y0 and box.y1 <= inside.y1 for box in boxes)
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    said, listed = {text.get_text() for text in labels}, " ".join(under[1:])
    for name in names if not is_crowded else ():
        assert name in said or name in listed, name
