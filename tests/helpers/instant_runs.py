"""Studies whose simulations take no time: results made of the scene alone, for tests of what surrounds them.

As a program: ``python instant_runs.py SECONDS_A_RUN STUDY.toml DIR WORKERS`` runs the design like that, and tells the
responses and the seeds that ran or leaves as a command does; with ``--whole`` it is ``doe study``, with the seeds on
standard error.
"""

import sys
import time
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from rbdyn.base.faults import RunError
from rbdyn.base.files import versions
from rbdyn.result import LargestLoads, PowerBalance, Quantity, SimulationResult
from rbdyn.scene import Scene


def instant_result(scene: Scene) -> SimulationResult:
    """A result whose figures follow the clearances, with the seed as scatter."""
    cage, seed = scene.cage, scene.numerics.seed
    base = 100.0 * cage.pocket_clearance_mm + 30.0 * cage.guide_clearance_mm + (seed * 7 % 5) * 0.1
    figures = {
        name: Quantity(base * scale, 0.01 * base * scale, None, 10.0, 9)
        for name, scale in (
            ("impact_force_N", 1.0),
            ("impact_contact_force_N", 1.0),
            ("whirl_deviation_ratio", 0.01),
            ("power_loss_W", 3.0),
            ("cage_speed_rpm", 200.0),
            ("cage_slip", 0.001),
        )
    }
    return SimulationResult(
        status="ok", figures=figures, power_balance=PowerBalance(0.0), power_terms_W={}, rolling_resistance_W={},
        loads=LargestLoads(1.0, 1.0, 1.0), races={}, clearance_um={}, friction_check=None, impact_window_turns=1.0, transient_turns=None, counted_turns=1.0, target=None, cost={},
        replicates=scene.numerics.replicates, seed=seed, notes=(), versions=versions(),
        scene=scene.model_dump(mode="json"),
    )  # fmt: skip


def with_figures(result: SimulationResult, **figures: Quantity) -> SimulationResult:
    """The result with other figures of the bearing."""
    return replace(result, figures=result.figures | figures)


def instantly(patch: Any, seconds: float = 0.0, faulty: Collection[int] = ()) -> list[int]:
    """Let simulations end after ``seconds``, those of the ``faulty`` seeds in a fault; returns the seeds that ran. Surfaces have
    no rivals: to leave out each run in turn takes seconds.

    ``patch(target, name, value)`` replaces an attribute, such as ``monkeypatch.setattr``.
    """
    from doe.workflow import surfaces
    from rbdyn.dynamics import run
    from rbdyn.dynamics import simulate as module

    ran: list[int] = []

    def simulate(
        scene: Scene, workers: Any = None, progress: Any = None, stop: Any = None, **more: Any
    ) -> SimulationResult:
        ran.append(scene.numerics.seed)
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            stop.check()
            time.sleep(0.001)
        if scene.numerics.seed in faulty:
            raise RunError(f"replicate 1 (seed {scene.numerics.seed}) stopped at t = 1e-05 s: the oil froze")
        return instant_result(scene)

    patch(surfaces, "MOST_RIVALLED", 0)
    patch(module, "simulate", simulate)
    patch(run, "prepare", lambda scene, bearing: 0.0)
    return ran


def unillustrated(patch: Any) -> None:
    """Let reports have empty pictures and show no motion, which takes most of the time of a study in no time."""
    from matplotlib.figure import Figure

    from doe import clearance
    from doe.report import files
    from doe.report.still import Still

    def save(figure: Figure, place: Any, **options: Any) -> None:
        if isinstance(place, str | Path):
            Path(place).write_bytes(b"")
        else:
            place.write("<svg/>")

    for picture in ("response_surface", "save"):
        patch(files, picture, lambda *content: content[-1].write_bytes(b""))
    patch(clearance, "histories", lambda *rest: {})
    patch(clearance, "draw_motion", lambda *rest: [])
    patch(Figure, "tight_layout", lambda figure, **options: None)
    patch(Figure, "savefig", save)
    patch(Still, "svg", lambda still: "<svg/>")


def main(seconds: float, study: Path, out: Path, workers: int, whole: bool = False) -> None:
    """The program."""
    from short_studies import run_design

    from doe.commands.functions import keeping_runs
    from doe.commands.functions import study as doe_study
    from doe.library.answer import registered
    from doe.workflow.problem import Problem
    from rbdyn.base.command import guarded, print_json
    from rbdyn.base.folder import output_folder

    ran = instantly(setattr, seconds)
    if whole:
        unillustrated(setattr)
        doe_study(study, out, workers=workers, as_json=True)
        print(ran, file=sys.stderr)
        return
    with guarded(as_json=True), keeping_runs(out), output_folder(out, "doe", ()) as folder, registered(study, out):
        folder.claim(study)
        runs = run_design(Problem.load(study), out, workers, lambda done, total: None)
        print_json({"values": runs.values.tolist(), "ran": ran})


if __name__ == "__main__":
    import typer

    typer.run(main)
