"""The templates of `surgebreak init`: one text with $names for each first case, and the questions that fill them in."""
