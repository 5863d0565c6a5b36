"""LaTeX document of the paper's tables and figures: its preamble, and the index on its first page."""

import re
from collections.abc import Iterable, Mapping

from vigil.analysis.tables.paper_index import ABSENT, PARTS
from vigil.analysis.tables.paper_style import INTERVALS
from vigil.analysis.tables.table import DASH
from vigil.analysis.tables.text import latex_escaped, latex_text

PREAMBLE = (
    r"\documentclass[10pt,twocolumn]{article}",
    r"\usepackage[textwidth=6.75in,textheight=9.2in,columnsep=0.25in]{geometry}",
    r"\usepackage{booktabs,graphicx,tabularx}",
    r"\usepackage[table]{xcolor}",
    r"\definecolor{FRtint}{RGB}{251,224,207}\definecolor{NRtint}{RGB}{207,228,245}",
    r"\setlength{\belowcaptionskip}{4pt}",
    r"\setcounter{topnumber}{9}\setcounter{dbltopnumber}{9}\setcounter{totalnumber}{9}",
    r"\renewcommand{\topfraction}{1}\renewcommand{\dbltopfraction}{1}\renewcommand{\textfraction}{0}",
    r"\makeatletter\setlength{\@fptop}{0pt}\setlength{\@dblfptop}{0pt}",
    r"\setlength{\@fpsep}{20pt}\setlength{\@dblfpsep}{20pt}\makeatother",
    r"\renewcommand{\floatpagefraction}{.7}\renewcommand{\dblfloatpagefraction}{.7}",
)
"""First lines of a LaTeX document with the paper's tables."""
_TITLE = re.compile(r"[^.:]*")
"""Pattern of the title of a figure, which is the start of its caption."""


def index_lines(tables: Iterable[str], figures: Mapping[str, str]) -> list[str]:
    """Return the LaTeX of an index with the number and page of each table and figure: tables left, figures right. In
    both columns the paper's parts come first, and further tables or figures are under a separate heading.

    `tables` are names of files without their ending; `figures` are {name: caption}.
    """
    shown = list(tables)
    lines: dict[str, list[str]] = {"Tables": [], "Further tables": [], "Figures": [], "Further figures": []}
    for part in PARTS:
        is_here = part.place in (figures if part.is_figure else shown)
        panel = part.label[part.label.index(" ") :] if " " in part.label else ""
        line = _index_line(part.place, part.what, panel, part.is_figure, is_here)
        lines["Figures" if part.is_figure else "Tables"].append(line)
    lines["Further tables"] += [
        rf"Table~\ref{{tab:{name}}} & Intervals of Table~\ref{{tab:{name.removesuffix(INTERVALS)}}} & "
        rf"\pageref{{tab:{name}}} \\"
        for name in shown
        if name.endswith(INTERVALS)
    ]
    known = {part.place for part in PARTS}
    for name, text in figures.items():
        title = _TITLE.match(text)
        if title and name not in known:
            lines["Further figures"].append(_index_line(name, title.group(), "", True, True))
    columns = {heading: _index_column(heading, found) for heading, found in lines.items() if found}
    tables_end = [*columns["Tables"], *columns.get("Further tables", [])]
    return [*tables_end, r"\newpage", *columns["Figures"], *columns.get("Further figures", []), r"\clearpage"]


def _index_column(heading: str, lines: Iterable[str]) -> list[str]:
    kinds = r"@{}l>{\raggedright\arraybackslash}Xr@{}"
    begin = rf"{{\small\noindent\begin{{tabularx}}{{\linewidth}}[t]{{{kinds}}}"
    return [rf"\section*{{{heading}}}", begin, *lines, r"\end{tabularx}\par}"]


def _index_line(name: str, what: str, panel: str, is_figure: bool, is_here: bool) -> str:
    if not is_here:
        return rf"{latex_escaped(DASH)} & {latex_text(what)} ({ABSENT}) & \\"
    kind, label = ("Figure", f"fig:{name}") if is_figure else ("Table", f"tab:{name}")
    return rf"{kind}~\ref{{{label}}}{panel} & {latex_text(what)} & \pageref{{{label}}} \\"
