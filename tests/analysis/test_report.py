"""Reports, figures and the two verbs: every table in every format, over whole, partial and empty runs."""

import ast
import csv
import io
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from markupsafe import escape
from matplotlib.text import Annotation
from typer.testing import CliRunner

from tests.support.narrowing import present
from tests.support.published_runs import EpisodeScript, Write, make_episodes, small_records, write_anchor, write_pack
from tests.support.small_runs import writer
from vigil.analysis.measures.closure import ClosureRun
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import Study, study
from vigil.analysis.plots.figures import FIGURES
from vigil.analysis.plots.style import canvas, figure_bytes
from vigil.analysis.report import FORMATS, LIMITS, html_report, json_report, make_report, write_report
from vigil.analysis.tables.closure_tables import closure_tables
from vigil.analysis.tables.page import html_table
from vigil.analysis.tables.registry import PAPER_TABLES, TABLES, tables
from vigil.analysis.tables.table import Column, Table, TableRow, formatted
from vigil.analysis.tables.text import csv_text, latex, markdown
from vigil.base.glossary import RESULTS, term_of
from vigil.cli import app
from vigil.errors import SettingError
from vigil.protocol.profile import ACTION_FEEDBACK, Profile
from vigil.records.record import ProviderFacts, Resumption, read_header

PAPERS_OWN = [
    "global_cross_section",
    "full_panel",
    "extended_panel",
    "proprio_minimal",
    "counterfactual",
    "belief_lag",
    "conditional_report",
    "prompt_sensitivity",
    "open_repeat_robustness",
    "episode_distribution",
    "family_specs",
    "action_specs",
    "intents",
    "report_statuses",
    "failure_taxonomy",
    "benchmark_comparison",
]


def test_headings_lead_to_the_glossary_at_the_foot(write: Write) -> None:
    page = html_report(make_report(study(read_runs([write("run")])), ()))
    links = set(re.findall(r'href="#term-([^"]+)"', page))
    assert {"w", "b", "delta", "fr", "regime", "p-fr-w-0", "closure-lag", "holm"} <= links
    assert all(f'<dt id="term-{link}">' in page for link in links)


def test_a_heading_of_the_glossary_is_one_of_a_table(mixed: Study) -> None:
    stress = closure_tables([ClosureRun("run", mixed.runs[0].header, (), 0, ())])
    headings = [column.heading for table in (tables(mixed) | stress).values() for column in table.columns]
    led = {(term, heading) for heading in headings if (term := term_of(heading)) is not None}
    unused = [
        alias
        for terms in RESULTS.values()
        for term in terms
        for alias in term.aliases
        if not any(found is term and heading.startswith(alias) for found, heading in led)
    ]
    assert unused == []


def test_own_tables_come_last_in_every_format(write: Write, tmp_path: Path) -> None:
    def mine(found: Study) -> Table:
        rows = tuple(TableRow({"model": entry.name}) for entry in found.entries)
        return Table("mine", "My table", (Column("model", "Run", "text"),), rows)

    found = study(read_runs([write("run")]))
    files = {
        path.name for path in write_report(found, tmp_path / "r", ("md", "latex", "csv", "json"), own={"mine": mine})
    }
    assert {"mine.tex", "mine.csv"} <= files
    page = html_report(make_report(found, (), own={"mine": mine}))
    assert page.index('id="protocol-and-pack"') < page.index('id="own-tables"') < page.index('<section id="mine">')
    assert list(make_report(found, (), own={"mine": mine}).sections)[-1] == "Own tables"
    with pytest.raises(SettingError, match="a table 'overview' already"):
        make_report(found, (), own={"overview": mine})


def lost(family: str) -> EpisodeScript:
    return EpisodeScript(family, False, "NR")  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory, small_pack: Path, usual_agent: str) -> Study:
    """A full run with and without feedback and with the neutral prompt, one without success, one empty, one partial."""
    records, write = small_records(), writer(tmp_path_factory.mktemp("mixed"), small_pack, usual_agent)
    folders = [
        write("base"),
        write("fb", small_records(lost), profile=Profile(name=ACTION_FEEDBACK)),
        write("neutral", small_records(lost), profile=Profile(prompt_variant="neutral_report")),
        write("lost", small_records(lost), agent="vllm/lost-A3B"),
        write("empty", {}, agent="vllm/empty"),
        write("partial", {"PG-000": records["PG-000"]}, agent="solver", kind="privileged"),
    ]
    return study(read_runs(folders))


@pytest.fixture(scope="module")
def reported(mixed: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report about these runs in every format."""
    folder = tmp_path_factory.mktemp("reported")
    write_report(mixed, folder, FORMATS)
    return folder


def text_of(file: Path) -> str:
    return file.read_text(encoding="utf-8")


def test_the_papers_sixteen_tables_go_by_its_names():
    assert list(PAPER_TABLES) == PAPERS_OWN


@pytest.mark.parametrize("with_paper", [True, False])
def test_every_table_builds_over_any_runs(mixed: Study, with_paper: bool):
    for found in (mixed, study(mixed.runs[:1], with_paper=with_paper), study([], with_paper=with_paper)):
        made = tables(found)
        assert list(made) == list(TABLES)
        for name, table in made.items():
            assert table.name == name
            for row in table.rows:
                assert row.cells.keys() & {column.key for column in table.columns}
                assert all("nan" not in table.cell(row, column).lower().split() for column in table.columns)


def test_rows_find_their_panels(mixed: Study):
    made = tables(mixed)
    own = {
        name: [row.cells["model"] for row in made[name].rows if not row.is_published]
        for name in ("global_cross_section", "extended_panel", "proprio_minimal", "prompt_sensitivity")
    }
    assert own["global_cross_section"] == ["model", "solver (privileged)", "empty"]
    assert own["extended_panel"] == ["lost-A3B"]
    assert own["proprio_minimal"] == ["model"]
    assert own["prompt_sensitivity"] == ["model [neutral_report]"]
    for name in ("counterfactual", "belief_lag", "conditional_report"):
        (excluded,) = [row for row in made[name].rows if row.cells["model"] == "lost-A3B"]
        assert excluded.group.startswith("Excluded from the main tables")
    solver = next(row for row in made["global_cross_section"].rows if row.cells["model"] == "solver (privileged)")
    assert solver.is_privileged
    assert not solver.bold


def test_own_rows_alone_without_the_paper(mixed: Study):
    made = tables(study(mixed.runs, with_paper=False))
    for name in ("global_cross_section", "belief_lag", "counterfactual", "conditional_report"):
        assert not any(row.is_published for row in made[name].rows)


def test_faults_and_limits_stand_before_any_number(reported: Path):
    page = text_of(reported / "report.html")
    for text in ("empty: no episode is scored", "INCOMPLETE: 1 of 16", str(escape(LIMITS[0][:40]))):
        assert page.index(text) < page.index("<table")


def test_the_latex_document_says_what_the_page_says_before_its_tables(reported: Path):
    document = text_of(reported / "report.tex")
    for text in (
        "empty: no episode is scored",
        r"\item W is what the simulator's hidden state",
        r"$^\ddagger$ privileged",
    ):
        assert document.index(text) < document.index(r"\input{")
    assert r"\subsection*{Read this first}" in document
    assert balanced(document)


def test_why_a_run_fell_short_stands_above_the_numbers_in_every_format(reported: Path):
    data = json.loads(text_of(reported / "report.json"))
    (run,) = (name for name in data["causes"] if name == "lost-A3B")
    assert any("`NR`" in sentence or "`honest_fail`" in sentence for sentence in data["causes"][run])
    for name, numbers in (("report.html", "<table"), ("report.md", "## Findings"), ("report.tex", r"\input{")):
        text = text_of(reported / name)
        assert text.index("Why episodes were not verified successes") < text.index(numbers)


def test_the_page_shows_figures_and_findings_and_folds_the_rest(reported: Path):
    page = text_of(reported / "report.html")
    parts = re.findall(r'<details( open)?><summary><h2 id="([^"]+)"', page)
    assert [name for is_open, name in parts if is_open] == ["figures", "findings-at-a-glance"]
    assert len(parts) == page.count("<details") > 5


def test_packs_of_one_name_are_named_once(write: Write):
    (run,) = read_runs([write("run")])
    spec = run.header.spec.model_copy(update={"pack_sha256": "f" * 64})
    other = replace(run, name="other", header=run.header.model_copy(update={"spec": spec}))
    page = html_report(make_report(study([run, other]), ()))
    name, ours = run.header.spec.pack, run.header.spec.pack_sha256[:12]
    assert f"packs {name} ({ours} and {'f' * 12})." in page


def test_names_in_sentences_are_set_as_code():
    table = Table("t", "T", (Column("model", "Model", "text"),), (), ("NR is `fail_no_report` alone.",))
    assert r"NR is \texttt{fail\_no\_report} alone." in latex(table)
    assert "NR is <code>fail_no_report</code> alone." in html_table(table)
    assert "NR is `fail_no_report` alone." in markdown(table)


def test_long_texts_are_folded_in_latex():
    columns = (Column("a", "A", "text"), Column("b", "B", "text"), Column("n", "n", "count"))
    rows = (TableRow({"a": "short", "b": "long " * 40, "n": 1}),)
    assert r"\begin{longtable}{lp{300pt}r}" in latex(Table("t", "T", columns, rows))


def test_the_page_needs_nothing_beside_it(reported: Path):
    page = text_of(reported / "report.html")
    sources = re.findall(r"""(?:src|href)=["']([^"']*)""", page)
    assert all(source.startswith(("data:", "#")) for source in sources)
    assert "<!--" not in page
    assert all(f'id="{name}"' in page for name in TABLES)
    assert page.count("data:image/svg+xml") == len(FIGURES)


def test_all_formats(mixed: Study, tmp_path: Path):
    written = write_report(mixed, tmp_path / "out", FORMATS)
    assert {"report.md", "report.html", "report.tex", "report.json", "rows.csv", "rows.parquet"} <= {
        path.name for path in written
    }
    data = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert list(data["tables"]) == ["paper_index", *TABLES]
    assert data["warnings"]
    rows = pd.read_parquet(tmp_path / "out" / "rows.parquet")
    assert len(rows) == 4 * 16 + 1
    for name in TABLES:
        reader = csv.DictReader(io.StringIO((tmp_path / f"out/tables/{name}.csv").read_text(encoding="utf-8")))
        lines, names = list(reader), list(reader.fieldnames or ())
        assert len(set(names)) == len(names), name
        assert len(lines) == len(data["tables"][name]["rows"]), name
        text = (tmp_path / "out" / "tables" / f"{name}.tex").read_text(encoding="utf-8")
        assert text.isascii() or name in ("benchmark_comparison", "comparisons"), name
        assert balanced(text), name


SNIPPETS = re.findall(
    r"```python\n(.*?)```", (Path(__file__).parents[2] / "docs/analysis.md").read_text(encoding="utf-8"), re.DOTALL
)


def test_the_rows_say_what_their_runs_were_made_under(mixed: Study, write: Write, tmp_path: Path):
    warm = read_runs([write("warm", agent="vllm/warm", sampling={"temperature": 0.5})])
    write_report(study([*mixed.runs, *warm]), tmp_path, ("csv",))
    rows, text = pd.read_parquet(tmp_path / "rows.parquet"), pd.read_csv(tmp_path / "rows.csv")
    assert list(rows) == list(text)
    made_under = ["pack", "prompt_variant", "reply_policy", "profile", "thinking", "backend"]
    assert set(map(tuple, rows[made_under].drop_duplicates().to_numpy())) == {
        ("synthetic", "default", "strict", Profile().name, "default", "mujoco"),
        ("synthetic", "default", "strict", ACTION_FEEDBACK, "default", "mujoco"),
        ("synthetic", "neutral_report", "strict", Profile().name, "default", "mujoco"),
    }
    assert set(rows["model"][rows["temperature"] == 0.5]) == {"warm"}
    assert int(np.count_nonzero(rows["temperature"].isna())) == len(rows) - 16


def test_the_docs_snippet_for_pandas_runs(
    mixed: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    (snippet,) = [text for text in SNIPPETS if "pandas" in text]
    write_report(mixed, tmp_path / "r", ("csv",))
    monkeypatch.chdir(tmp_path)
    exec(compile(snippet, "docs/analysis.md", "exec"), {})
    shown = capsys.readouterr().out.splitlines()
    models = {"model": 8, "lost-A3B": 8, "solver (privileged)": 1}
    assert shown[0].split() == ["W", "B"]
    assert len(shown) == 2 + sum(models.values())
    assert all(sum(line.startswith(model) for line in shown[2:]) == 1 for model in models)


def test_the_docs_snippet_for_datasets_reads_the_same_file():
    """The library is large and no dependency: the snippet is parsed, and its file is that of the one for pandas."""
    (snippet,) = [text for text in SNIPPETS if "datasets" in text]
    (other,) = [text for text in SNIPPETS if "pandas" in text]
    calls = [node for node in ast.walk(ast.parse(snippet)) if isinstance(node, ast.Call)]
    (call,) = calls
    named = {keyword.arg: ast.literal_eval(keyword.value) for keyword in call.keywords}
    assert ast.literal_eval(call.args[0]) == "parquet"
    assert set(named) == {"data_files", "split"}
    assert named["data_files"] in other


def balanced(text: str) -> bool:
    bare = re.sub(r"\\[{}]", "", text)
    return bare.count("{") == bare.count("}") and text.count(r"\begin{") == text.count(r"\end{")


def test_the_same_runs_give_the_same_bytes(mixed: Study):
    first, second = (json_report(make_report(study(runs), ())) for runs in (mixed.runs, mixed.runs))
    assert first == second
    assert figure_bytes(draw(mixed, "plane"), "svg") == figure_bytes(draw(mixed, "plane"), "svg")


def draw(found: Study, name: str):
    figure = FIGURES[name](found)
    assert figure is not None
    return figure


def drifting(family: str) -> EpisodeScript:
    return EpisodeScript(family, True, "NR")  # type: ignore[arg-type]


def test_the_partition_marks_w_and_says_how_far_it_is_from_b(write: Write):
    folders = [write("base"), write("drift", small_records(drifting), agent="vllm/drift")]
    (axes,) = draw(study(read_runs(folders)), "outcome_partition").axes
    assert [np.asarray(mark.get_xdata())[0] for mark in axes.lines] == [100.0, 100.0]
    gaps = [text.get_text().split()[1] for text in axes.texts if text.get_text().startswith("W−B")]
    assert gaps == ["0.0", "100.0"]


@pytest.mark.parametrize("name", FIGURES)
def test_figures_of_nothing_are_left_out(name: str):
    assert FIGURES[name](study([])) is None


def test_labels_in_the_plane_cover_neither_each_other_nor_the_frame(tmp_path: Path):
    write_pack(tmp_path / "pack", make_episodes())
    models = ("GPT-5.4", "Claude-Sonnet-4", "InternVL3.5-38B", "Qwen3-VL-32B")
    found = study(read_runs([write_anchor(tmp_path / model, tmp_path / "pack", model) for model in models]))
    figure = draw(found, "plane")
    figure_bytes(figure, "png")
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    axes = figure.axes[0]
    boxes = [
        text.get_window_extent(renderer) for text in axes.texts if isinstance(text, Annotation) and text.get_text()
    ]
    assert len(boxes) == 14
    assert not [1 for index, box in enumerate(boxes) for other in boxes[:index] if box.overlaps(other)]
    assert axes.get_title(loc="left") == "World completion and terminal commitment (n=1,000)"
    frame = axes.get_window_extent(renderer)
    assert all(frame.x0 <= box.x0 and box.x1 <= frame.x1 for box in boxes)


@pytest.mark.parametrize(
    ("value", "kind", "text"),
    [
        (None, "number1", "–"),
        ((None, 1), "pair", "–"),
        ((57.7, 56.4), "pair", "57.7/56.4"),
        ((1.26, -0.5, 3.0), "rate", "1.3 [−0.5, 3.0]"),
        ((1.26, None, None), "rate", "1.3"),
        ((42.6, 0.6), "spread", "42.6 ± 0.6"),
        (-0.01, "number1", "0.0"),
        (-0.01, "signed1", "0.0"),
        (13.94, "signed1", "+13.9"),
        (-9.2, "signed1", "−9.2"),
        (-10.04, "signed1", "−10.0"),
        (0.0001, "p", "< 0.001"),
        (1000, "count", "1,000"),
    ],
)
def test_cells_print_as_in_the_paper(value: object, kind: str, text: str):
    assert formatted(value, kind) == text  # type: ignore[arg-type]


def test_text_is_escaped_in_every_format():
    nasty = "a|b_c & <i>50 %</i> $x$ {y} \\z"
    table = Table("t", "T", (Column("model", "Model", "text"),), (TableRow({"model": nasty}),))
    assert "a\\|b\\_c" in markdown(table)
    assert "&lt;i&gt;" in html_table(table)
    assert "<i>" not in html_table(table)
    assert r"\$x\$ \{y\} \textbackslash{}z" in latex(table)
    assert r"\& $<$i$>$50 \%" in latex(table)


NOT_HOLDABLE = "".join(map(chr, (0, 1, 8, 11, 12, 14, 27, 31, 0x7F, 0x85, 0xD800, 0xDFFF, 0xFFFE, 0xFFFF)))


def test_no_format_holds_what_markup_cannot():
    table = Table("t", "T", (Column("model", "Model", "text"),), (TableRow({"model": f"a{NOT_HOLDABLE}b"}),))
    for text in (markdown(table), latex(table), html_table(table)):
        assert not set(NOT_HOLDABLE) & set(text)
        assert "\ufffd" * len(NOT_HOLDABLE) in text


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_a_figure_of_any_text_is_a_valid_file(kind: str):
    figure = canvas(3, 2)
    axes = figure.subplots()
    axes.set_title(f"a{NOT_HOLDABLE}b -- <&> \t \r")
    content = figure_bytes(figure, kind)
    if kind == "svg":
        assert ElementTree.fromstring(content).tag.endswith("svg")
        assert not {0, 1, 27} & set(content)


@pytest.mark.parametrize(
    "text", ["=HYPERLINK(1)", "+1+1", "-1+1|cmd", "@SUM(1)", "\t=1", "\r=1", "\n=1", "a\r=1", "fail", "5 - 3", "", "'x"]
)
def test_no_text_of_a_csv_file_is_a_formula(text: str):
    table = pd.DataFrame({"status": pd.Series([text, None], dtype=object), "delta": [-0.5, 1.0]})
    written = csv_text(table)
    (first, second) = csv.reader(io.StringIO(written.partition("\n")[2], newline=""))
    is_plain = text[:1] in ("f", "5", "", "'", "a")
    assert first == [(text if is_plain else f"'{text}").replace("\r", "\n"), "-0.5"]
    assert second == ["", "1.0"]


def test_what_an_agent_wrote_enters_no_csv_file_as_a_formula(write: Write, tmp_path: Path):
    records = small_records()
    last = records["PG-000"].steps[-1]
    assert last.action is not None
    spoilt = last.action.model_copy(update={"status": "invalid", "raw_status": '=hyperlink("http://x")'})
    told = last.model_copy(update={"action": spoilt})
    records["PG-000"] = records["PG-000"].model_copy(update={"steps": (*records["PG-000"].steps[:-1], told)})
    write_report(study(read_runs([write("a", records)])), tmp_path, ("csv",))
    rows = pd.read_csv(tmp_path / "rows.csv")
    assert '\'=hyperlink("http://x")' in set(rows["raw_status"])
    for path in tmp_path.rglob("*.csv"):
        with path.open(newline="") as file:
            cells = [cell for row in csv.reader(file) for cell in row]
        assert not [cell for cell in cells if cell.startswith(("=", "+", "@", "\t", "\r"))], path


def test_a_long_table_has_its_head_on_each_page():
    text = latex(Table("t", "T", (Column("model", "Model", "text"),), (TableRow({"model": "m"}),)))
    assert text.count(r"\toprule") == 2
    assert text.index(r"\endfirsthead") < text.index(r"\endhead") < text.index("m \\\\\n\\bottomrule")


def test_a_wide_table_continues_below_after_its_first_columns():
    columns = (
        Column("model", "Model", "text"),
        *(Column(f"c{i}", f"Column with number {i}", "number1") for i in range(12)),
    )
    row = TableRow({"model": "some model", **{f"c{i}": float(i) for i in range(12)}})
    text = latex(Table("t", "T", columns, (row,)))
    blocks = text.split(r"\begin{longtable}")[1:]
    assert len(blocks) == 2
    assert all(block.count("some model & ") == 1 for block in blocks)
    assert [text.count(f"with number {i} ") for i in range(12)] == [2] * 12
    assert text.count(r"\label{tab:t}") == 1
    assert "resizebox" not in text
    assert text.count("{") == text.count("}")


def test_the_latex_index_names_pages_that_exist(reported: Path):
    document = text_of(reported / "report.tex")
    shown = re.findall(r"\\input\{(tables/.*?)\}", document)
    texts = [document, *(text_of(reported / name) for name in shown)]
    labels = {label for text in texts for label in re.findall(r"\\label\{(.*?)\}", text)}
    referred = {label for text in texts for label in re.findall(r"\\pageref\{(.*?)\}", text)}
    assert {"tab:full_panel", "fig:outcome_partition"} <= referred <= labels
    empty = document[document.index("do not apply to any of these runs") :]
    assert r"\label{tab:several_plays}" in empty
    assert "tables/several_plays.tex" not in shown


def command(*arguments: object):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_report_prints_markdown_or_writes_files(write: Write, tmp_path: Path):
    run = write("run")
    shown = command("report", run)
    assert shown.exit_code == 0
    assert "# VIGIL report" in shown.output
    assert "16 scored episodes" in shown.output
    out = tmp_path / "report"
    assert command("report", run, "--out", out, "--format", "csv,json").exit_code == 0
    assert (out / "report.json").is_file()
    assert not (out / "report.html").exists()


def test_check_asserts_the_identities_on_records(write: Write):
    found = command("report", write("a"), write("b", small_records(lost)), "--check")
    assert found.exit_code == 0
    assert "2 runs, 32 scored episodes: 0 identities broken" in found.output


def test_check_fails_on_a_broken_identity(write: Write, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(
        "vigil.analysis.measures.metrics.broken_run_identities", lambda run: [f"{run.name}, all: Stop + NR + IL = all"]
    )
    found = command("report", write("a"), "--check")
    assert found.exit_code == 1
    assert "Stop + NR + IL = all" in found.output


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["report", "RUN", "--format", "htlm"], "Did you mean 'html'"),
        (["report", "RUN", "--format", "csv"], "give their folder with --out"),
        (["report", "RUN", "--episode", "PG-0000", "--out", "x"], "Did you mean 'PG-000'"),
        (["report", "nowhere"], "has no run.json"),
        (["figure", "planet", "RUN"], "Did you mean 'plane'"),
        (["figure", "plane"], "give their folders"),
        (["figure", "plane", "RUN", "--out", "x.gif"], ".png, .pdf, .svg"),
        (["figure", "plane", "RUN", "--out", "nowhere/x.png"], "does not exist"),
        (["figure", "feedback_shift", "RUN", "--out", "x.png"], "nothing to show"),
    ],
)
def test_bad_input_is_named(write: Write, arguments: Sequence[str], says: str):
    run = str(write("run"))
    found = command(*[run if argument == "RUN" else argument for argument in arguments])
    assert found.exit_code != 0
    assert says in str(found.exception)


def test_a_figure_is_written_in_its_files_format(write: Write, tmp_path: Path):
    run = write("run")
    for suffix, start in (("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")):
        out = tmp_path / f"plane.{suffix}"
        assert command("figure", "plane", "--runs", run, "--out", out).exit_code == 0
        assert out.read_bytes().startswith(start)


def test_the_reasons_of_invalid_replies_stand_below_their_table(write: Write) -> None:
    garbled = study(
        read_runs([write("fine"), write("garbled", small_records(lambda f: EpisodeScript(f, False, "IL")))])
    )
    notes = TABLES["invalid_replies"](garbled).notes
    said = [note for note in notes if "not actions" in note]
    assert len(said) == 1
    fraction = garbled.entries[1].run.rows
    invalid = int(np.sum(fraction["protocol_failures"] + fraction["malformed_actions"]))
    assert f"of the replies are not actions ({invalid} " in said[0]


def test_what_really_answered_stands_beside_what_was_asked_for(write: Write) -> None:
    folder = write("run", agent="vllm/alias")
    header = read_header(folder)
    answered = ProviderFacts(replies=3, models={"alias-2026": 3}, replies_with_reasoning=1)
    later = Resumption(started=header.started, rows_before=1, answered=ProviderFacts(models={"alias-2027": 1}))
    changed = header.model_copy(update={"answered": answered, "resumed": (later,)})
    (folder / "run.json").write_text(changed.model_dump_json(), encoding="utf-8")
    (row,) = (
        row for row in TABLES["models"](study(read_runs([folder, write("silent")]))).rows if row.cells.get("answered")
    )
    assert (row.cells["api"], row.cells["answered"]) == ("vllm/alias", "alias-2026, alias-2027")
    assert row.cells["thinking"] == "yes"


def test_a_long_name_leaves_room_for_the_bars(write: Write):
    name = "vllm/a-model-with-a-name-of-many-parts-235B-A22B-thinking-and-more-of-it-still"
    figure = FIGURES["belief_closure"](study(read_runs([write("run", agent=name)])))
    assert figure is not None
    figure_bytes(figure, "svg")
    left, right = figure.axes[:2]
    assert present(left.get_tightbbox()).x1 <= right.get_window_extent().x0 + 60
    (label,) = left.get_yticklabels()
    assert max(map(len, label.get_text().split("\n"))) <= 40
