"""The site: docs/, the pages of the cases and of the project, as HTML that needs no network (`surgebreak docs`).

mkdocs builds it from mkdocs.yml; `hooks` is what it calls on the way: pages from outside of docs/, Markdown as GitHub
reads it, equations as MathML.
"""
