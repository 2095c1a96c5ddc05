"""Tables that a user hands in: ``sheet`` reads text, workbooks and frames, columns, and numbers in bounds.

- ``decimal_marks``: decimal points and commas; ``workbook``: Excel workbooks
"""
