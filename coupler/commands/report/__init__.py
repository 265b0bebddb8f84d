"""One HTML file about a run or a study, complete in itself, that reads well on paper too."""
