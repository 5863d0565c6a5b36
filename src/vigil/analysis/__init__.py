"""Analysis: tables, figures and reports from saved runs, without a simulator."""
