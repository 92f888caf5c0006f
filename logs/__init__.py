"""The records: journal, MCAP, Rerun view, recovery, export, report."""
