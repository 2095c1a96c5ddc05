"""Tables that a user hands in: ``sheet`` reads text and workbooks, columns, and numbers in bounds.

- ``decimal_marks``: decimal points and commas; ``workbook``: Excel workbooks
"""
