"""``doe keys``."""

from typing import TYPE_CHECKING

from rbdyn.base.command import Json, guarded
from rbdyn.scene.keys import AsSchema, Word, run

if TYPE_CHECKING:
    from pydantic import BaseModel


def keys(word: Word = None, as_schema: AsSchema = False, as_json: Json = False) -> None:
    """Explain every key of a study or of a dimension chain: its meaning, its unit, range and default."""
    with guarded(as_json):
        run(kinds(), word, as_schema, as_json)


def kinds() -> "dict[str, type[BaseModel]]":
    """The kinds of files that ``doe`` reads."""
    from doe.dimension_chain.links import Chain
    from doe.dimension_chain.reading import Chains
    from doe.study_file import StudyFile

    return {"study": StudyFile, "chain": Chain, "file of chains": Chains}
