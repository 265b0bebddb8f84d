"""The command `surgebreak diff`: two or more runs side by side.

case       the keys of the case whose values differ
figures    verdict, loads, gauges, accuracy and cost of each run
curves     the histories that are drawn over one another
table      the table for the terminal
page       the same as JSON and as an HTML page
arguments  the arguments of the command
command    the command: reads the runs, prints the table, writes page and figures
"""
