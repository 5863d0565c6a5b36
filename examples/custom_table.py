"""From records to your own table: how many steps an agent takes after the goal holds, by family.

    python examples/custom_table.py runs/gpt-4o runs/qwen --out report    # folders of runs, as for `vigil report`

The script prints the rows as a pandas table, and with `--out` writes them as a table of the report, after the others.
"""

import argparse
from pathlib import Path

import pandas as pd

from vigil.analysis.measures.rows import combined_rows, read_runs
from vigil.analysis.measures.study import Study, study
from vigil.analysis.report import write_report
from vigil.analysis.tables.table import Column, Table, TableRow, counts, numbers


def overtime(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the number of steps after the goal first held, for the episodes in which it held."""
    held = rows[rows["first_goal_step"].notna()]
    steps = held["steps"] - held["first_goal_step"]
    return held.assign(overtime=steps).pivot_table("overtime", "run", "family", aggfunc="mean")


def overtime_table(found: Study) -> Table:
    """Return the mean over all families as a table of the report, with a row per run."""
    rows = []
    for entry in found.entries:
        steps = (entry.run.rows["steps"] - entry.run.rows["first_goal_step"]).dropna().tolist()
        cells = {"model": entry.name, "n": len(steps), "overtime": sum(steps) / len(steps) if steps else None}
        rows.append(TableRow(cells, is_privileged=entry.run.model.is_privileged))
    columns = (Column("model", "Run", "text"), *counts(n="Goal held"), *numbers(overtime="Steps after that"))
    return Table("overtime", "Steps after the goal first held", columns, tuple(rows), ("The closing report counts.",))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("runs", nargs="+", type=Path, help="folders of runs")
    options.add_argument("--out", type=Path, help="also write a report with the table into this folder")
    given = options.parse_args()
    runs = read_runs(given.runs)
    print(overtime(combined_rows(runs)).round(1).to_string(na_rep="-"))
    if given.out is not None:
        files = write_report(study(runs, with_paper=False), given.out, ("md",), own={"overtime": overtime_table})
        print(files[0])


if __name__ == "__main__":
    main()
