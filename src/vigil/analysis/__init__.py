"""Analysis: tables, figures and reports made from saved runs alone; never from a simulator."""
