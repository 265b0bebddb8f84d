"""First cases of `surgebreak init`: a text with $names for each, and what is asked for them."""
