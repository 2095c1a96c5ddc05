"""The front of a noisy simulator in few runs: emulators learn it, and each run goes where it is expected to gain most.

- ``emulators``: an emulator a response, and what they say of goals and limits
- ``acquisition``: candidate points, and the expected gain in hypervolume as an integral over what is not yet dominated
- ``search``: design, batches, fresh runs; when to go beyond the region, when to stop, and what came out
"""

from doe.adaptive.emulators import Border, Evaluate, Runs
from doe.adaptive.search import AdaptiveFront, Batch, Plan, adaptive_front
