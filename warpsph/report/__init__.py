"""`warpsph report`: the paper's cases, run and laid out beside the paper's and the exact results.

From the ground up: `runs` makes one run and reads it back (`cli/queue.py` makes those that are missing, several at
a time); `drawing` makes pictures; `cases/` says of each case what to run, draw and tabulate; `page` writes HTML
and Markdown; `make` puts them together; `command` is the command line's side of it.
"""
