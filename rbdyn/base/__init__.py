"""Shared parts of both packages, without any bearing: input, records, files, words and commands.

- ``faults``: what a user typed, its number types, and errors that say how to fix them; ``arrays``: their types, and algebra on one thread
- ``records``: results as JSON, tables and CSV; ``files``: whole JSON files, and finished parts on disk; ``digests``: of contents, and of the code they depend on
- ``tables``: tables of a user, text and workbooks
- ``estimate``: values with their errors, sums, differences and intervals of them
- ``words``: how values, errors and counts are written; ``blocks``: what is said, and tables by their columns; ``terminal``, ``html``: its
  renderings, that as one page with its pictures
- ``workbook``: tables of a report; ``identity``, ``notes``: its first lines
- ``loading``, ``streams``, ``command``: what commands share; ``folder``: where they write, and its lock
"""
