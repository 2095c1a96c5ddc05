"""The study that joins the steps.

- ``design``: the points of the study and what they can tell
- ``runs``, ``surfaces``: design runs, simulated or of a table, where any points run, and the surfaces through the runs
- ``goals``, ``front``, ``drawn``, ``predicted``: the front on the surfaces, how sure it is, what it promises
- ``adaptive``, ``searched_pick``: the front of the simulator itself, found in few runs, and its pick
- ``chosen``, ``confirmation``: points worth a simulation, and whether what they gain is real
- ``widest``, ``chains``: tolerances that keep the gains, and the parts
- ``checked``: one judgement of a study before anything runs
- ``stages``, ``stages_unknown``, ``status``, ``finished``: what a command runs, and where it stands
- ``reference``: a published table beside
- ``whole``: all of it in one go
"""
