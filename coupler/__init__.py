"""The coupler: cases, the coupled step, results. The only room that knows both sides."""
