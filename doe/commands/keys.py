"""``doe keys``."""

from typing import TYPE_CHECKING

from rbdyn.base.command import Json, guarded
from rbdyn.scene.keys import AsSchema, Word, run

if TYPE_CHECKING:
    from pydantic import BaseModel


def keys(word: Word = None, as_schema: AsSchema = False, as_json: Json = False) -> None:
    """Explain every key of a study, a dimension chain and a calibration, and the columns of measured tables."""
    with guarded(as_json):
        run(files() if as_schema else kinds(), word, as_schema, as_json)


def files() -> "dict[str, type[BaseModel]]":
    """The kinds of TOML files that ``doe`` reads next to scenes."""
    from doe.dimension_chain.links import Chain
    from doe.dimension_chain.reading import Chains
    from doe.study_file import StudyFile

    return {"study": StudyFile, "chain": Chain, "file of chains": Chains}


def kinds() -> "dict[str, type[BaseModel]]":
    """These, the tables of a scene that ``doe`` reads, and the tables of measurements, whose keys are columns."""
    from doe.workflow.rig import RigTable, SceneTables

    measured = "measurements on a rig, column"
    return {**files(), "unknown inputs and calibration of a scene": SceneTables, measured: RigTable}
