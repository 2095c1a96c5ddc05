"""The front of a noisy simulator in few runs: emulators learn it, and each run goes where it is expected to gain most.

- ``emulators``: runs, and an emulator of each response with its predictions of costs and limits; candidate points and the
  expected gain in hypervolume as an integral over levels that are not yet dominated
- ``search``: design, batches, fresh runs; when to move a face of the region, when to stop, and the result
"""

from doe.adaptive.emulators import Evaluate, Runs
from doe.adaptive.search import AdaptiveFront, AdaptiveSearch, Batch, Border, Plan
