"""What a report says of each subject: its JSON record from results, and its blocks from that record.

- ``record``: reading a record, any part of which may be missing; numbers for people
- ``answer``: what an engineer acts on; what was asked, what was confirmed
- ``design``, ``fit``, ``front`` with ``front_pictures``, ``search``, ``chain``: the steps in the order of a report
- ``duty``: every point of a duty; ``scene_runs``: every row of a table of scenes
- ``unknown``, ``calibration``: what unknown inputs do, and what measurements say about them
"""
