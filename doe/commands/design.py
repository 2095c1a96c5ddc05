"""``doe design``."""

from typing import Annotated

from doe.commands.options import Save, StudyPath
from doe.commands.steps import save
from rbdyn.base.blocks import Detail
from rbdyn.base.options import Json, flag
from rbdyn.base.render.terminal import show
from rbdyn.base.terminal import guarded, hand_over


def design(
    path: StudyPath,
    out: Save = None,
    as_json: Json = False,
    as_csv: Annotated[bool, flag("--csv", says="Print a CSV table and nothing else.")] = False,
    quiet: Annotated[bool, flag("--quiet", "-q", says="Actual values only.")] = False,
    verbose: Annotated[bool, flag("--verbose", "-v", says="Also seeds and leverages.")] = False,
) -> None:
    """Print the design: every run, and how well the runs can answer what is asked of them."""
    with guarded(as_json):
        from doe.report.steps.fit import blocks, design_record, print_csv
        from doe.study_file import Study
        from doe.workflow.runs import design_of, evaluation
        from doe.workflow.whole import check_study

        loaded = Study.load(path)
        # Without its scene the runs are made elsewhere, and only the design itself can be judged.
        if loaded.file.scene and loaded.beside(loaded.scene.file).exists():
            check_study(loaded)
        points = design_of(loaded)
        record = design_record(loaded, points, evaluation(loaded, points))
        save(out, path, "design.json", record)
        detail = Detail.of(quiet, verbose)
        hand_over(lambda: record, as_json, lambda: print_csv(record) if as_csv else show(blocks(record), detail))
