"""``rbdyn keys``: every key of a scene."""

from pydantic import BaseModel

from rbdyn.base.options import Json
from rbdyn.base.terminal import guarded
from rbdyn.scene.keys import AsSchema, Word, run


def command(word: Word = None, as_schema: AsSchema = False, as_json: Json = False) -> None:
    """Explain every key of a scene: its meaning, its unit, range and default."""
    with guarded(as_json):
        run(kinds(), word, as_schema, as_json)


def kinds() -> dict[str, type[BaseModel]]:
    """The kinds of scenes."""
    from rbdyn.scene import Scene
    from rbdyn.scene.ball import DoubleDeckerScene, SingleRowScene

    return {"roller bearing": Scene, "ball bearing": SingleRowScene, "double-decker": DoubleDeckerScene}
