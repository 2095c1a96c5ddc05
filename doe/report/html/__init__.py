"""A study as one HTML file that can be mailed: nothing fetched, readable without scripts and on paper.

- ``build``: the page, from blocks of ``doe.report.sections``; ``data``: the numbers for the scripts
- ``page.html``, ``report.css``: skeleton and looks; ``surface.html``, ``front.html``, ``bearing.html``: controls
- ``*.js``: the interactive pictures, each for itself; ``page.js`` holds what they share
"""

from doe.report.html.build import html_report
