"""What a report says of each subject: its JSON record from results, and its blocks from that record.

- ``answer``: what an engineer acts on; what was asked, what was confirmed
- ``design``, ``fit``, ``front`` with ``front_pictures``, ``chain``: the steps in the order of a report
- ``duty``: every point of a duty
- ``unknown``, ``calibration``: what unknown inputs do, and what measurements say about them
"""
