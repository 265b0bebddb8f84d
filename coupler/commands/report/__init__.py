"""One self-contained HTML file about a run or a study, which can also be printed."""
