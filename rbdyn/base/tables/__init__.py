"""Tables that a user hands in: ``table_file`` reads text and workbooks, ``sheet`` columns and numbers in bounds.

- ``decimal_marks``: decimal points and commas; ``workbook``, ``workbook_parts``: Excel workbooks
"""
