"""The house: imports run one way, few files lie loose, files and functions stay short, words are those of the field."""

import ast
import re
import subprocess
import tomllib
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp
import pytest
from prose import (
    EXAMPLES,
    NAME,
    PAGES,
    QUOTED,
    ROOT,
    SENTENCE_END,
    SOURCES,
    SQL,
    TOP_PAGES,
    comments,
    docstrings,
    messages,
    paragraphs,
    parsed,
    without_code,
    words_of,
)

LONGEST_FILE, LONGEST_FUNCTION, MOST_AT_THE_ROOT = 600, 70, 6
# Lines of code of both packages. A change may lower this freely. Raise it only with the feature that needs it, and say by
# how much in the commit.
MOST_CODE = 48_671
TOP = {
    ".ci", ".gitignore", "CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "README.md", "doe",
    "examples", "pyproject.toml", "rbdyn", "tests",
}  # fmt: skip
NOT_SI = re.compile(r"_(mm|mm2|um|mm_um|g|g_mm|rpm|deg|mrad|MPa|GPa)$")
KERNEL = re.compile(r"kernel|routine|entry|law_of\(|.*\.body\(|compiled_as\(")
# Where a drawing's own units may be read: what speaks to people, what makes scenes of scenes, and saved records.
EDGES = {
    "rbdyn/scene/": "where they leave as SI",
    "rbdyn/cli/": "speaks to people",
    "rbdyn/plots/": "speaks to people",
    "rbdyn/accuracy/coverage.py": "makes a scene of a scene",
    "rbdyn/accuracy/variants.py": "makes scenes of a scene",
    "rbdyn/result.py": "is the saved record",
    "rbdyn/quasistatic/result.py": "is the saved record",
    "rbdyn/quasistatic/preload.py": "makes scenes of a scene",
    "rbdyn/quasistatic/sweep.py": "is the saved record of the points",
    "rbdyn/dynamics/simulate.py": "saves the clearance as drawn",
    "rbdyn/dynamics/start.py": "saves the pressure where the clearance is least",
    "rbdyn/dynamics/parameters/validity.py": "speaks to people of the contacts saved",
    "rbdyn/dynamics/duty_simulation.py": "is the saved record of the points",
    "rbdyn/dynamics/slip_map.py": "is saved by the keys that it varies",
    "doe/dimension_chain/": "chains are in millimetres, as their drawings are",
    "doe/workflow": "asks for chains",
    "doe/study_file/": "checks chains",
    "doe/report/": "speaks to people",
}


def test_invariant_no_circle_of_imports():
    """Invariant: no module imports itself through others, imports inside functions and for typing only counted."""
    graph = grimp.build_graph("rbdyn", "doe", cache_dir=None)
    below = {
        module: {
            imported
            for imported in graph.find_modules_directly_imported_by(module)
            if not module.startswith(f"{imported}.")  # a module may name its own package
        }
        for module in graph.modules
    }
    assert below["rbdyn.cli"] == {"rbdyn.cli.app", "rbdyn.base.loading", "rbdyn.base.streams"}, "lazy imports count"
    try:
        TopologicalSorter(below).prepare()
    except CycleError as error:
        pytest.fail(f"circle: {' -> '.join(error.args[1])}")


def test_invariant_the_source_map_is_true():
    """Invariant: the map names every room once, and each room imports from rooms further on in it alone."""
    rooms: list[str] = []
    for row in re.findall(r"^\| (`\w+/.*?) \|", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.MULTILINE):
        package, _, row_rooms = row.strip("`").partition("/")
        rooms += [f"{package}.{room.removesuffix('.py')}" for room in row_rooms.split("`, `")]
    graph = grimp.build_graph("rbdyn", "doe", cache_dir=None)
    inside = [module for module in graph.modules if module.count(".") and not module.endswith(("__main__", "doe.cli"))]
    assert sorted(rooms) == sorted({room_of(module) for module in inside})
    upwards = [
        f"{module} -> {imported}"
        for module in inside
        for imported in map(str, graph.find_modules_directly_imported_by(module))
        if room_of(imported) in rooms and rooms.index(room_of(imported)) < rooms.index(room_of(module))
    ]
    assert not upwards


@pytest.mark.parametrize("page", [path for path in SOURCES if path.name == "__init__.py" and path.parents[1] != ROOT])
def test_invariant_a_package_tells_of_its_modules(page):
    """Invariant: the docstring of a package names each of its modules, and begins no entry with a module that is not there."""
    text = ast.get_docstring(parsed(page)) or ""
    modules = {path.stem for path in page.parent.glob("*.py")} - {"__init__"}
    modules |= {path.name for path in page.parent.iterdir() if path.is_dir() and path.name != "__pycache__"}
    entries = re.findall(r"(?:^- |; )((?:``\w+``(?:, )?)+):", text, re.MULTILINE)
    assert modules <= set(re.findall(r"``(\w+)``", text))
    assert {name for entry in entries for name in re.findall(r"\w+", entry)} <= modules


def room_of(module: str) -> str:
    """The package, or module, right within ``rbdyn`` or ``doe`` that a module is in."""
    return ".".join(module.split(".")[:2])


def test_invariant_files_and_functions_stay_short():
    """Invariant: no file above 600 lines, no function above 70, six files at the root of rbdyn."""
    long = []
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        if text.count("\n") > LONGEST_FILE:
            long.append(f"{path.name}: {text.count(chr(10))} lines")
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.FunctionDef) and node.end_lineno - node.lineno + 1 > LONGEST_FUNCTION:
                long.append(f"{path.name}: {node.name}")
    assert not long
    assert len(list((ROOT / "rbdyn").glob("*.py"))) <= MOST_AT_THE_ROOT


def test_invariant_the_programs_do_not_grow():
    """Invariant: both packages together have at most the stated lines of code; blanks, comments and documentation do not count."""
    code = 0
    for path in SOURCES:
        prose = {
            row
            for node in ast.walk(parsed(path))
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
            for row in range(node.lineno, node.end_lineno + 1)
        }
        lines = map(str.strip, path.read_text(encoding="utf-8").split("\n"))
        code += sum(bool(line) and line[0] != "#" and row not in prose for row, line in enumerate(lines, 1))
    assert 0 < code <= MOST_CODE, f"{code} lines of code, more than {MOST_CODE}"


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no clone")
def test_invariant_nothing_lies_at_the_top():
    """Invariant: what is committed lies in the packages, tests and examples, or is what tools look for at the top."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files"], capture_output=True, text=True, check=True).stdout
    assert {line.split("/")[0] for line in listed.splitlines()} == TOP


def test_invariant_units_end_at_the_scene():
    """Invariant: beyond the scene and the edges nothing reads millimetres, micrometres, grams, rpm, degrees or MPa."""
    found, needed = [], set()
    for path in SOURCES:
        name = path.relative_to(ROOT).as_posix()
        edge = next((edge for edge in EDGES if name.startswith(edge)), None)
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Attribute) and NOT_SI.search(node.attr):
                needed.add(edge)
                found += [f"{name}:{node.lineno} {node.attr}"] if edge is None else []
    assert not found
    assert needed == set(EDGES), "an edge that reads none is none"


# Calls whose ValueError may be put into words: conversions of one text or file, signals, and an integrator of SciPy.
CONVERSIONS = {"float", "int", "loads", "read_json", "decode", "parse", "solve_ivp", "open"}


def test_invariant_errors_of_libraries_are_not_the_users():
    """Invariant: the words of a ValueError are shown where one text was converted; all other sentences are our own errors."""
    words, found = 0, []
    for path in SOURCES:
        for node in ast.walk(parsed(path)):
            if not isinstance(node, ast.Try):
                continue
            called = {
                ast.unparse(each.func).rpartition(".")[2] for each in ast.walk(node) if isinstance(each, ast.Call)
            }
            for handler in (each for each in node.handlers if each.name and each.type):
                words += 1
                if re.search(r"\bValueError\b", ast.unparse(handler.type)) and not called & CONVERSIONS:
                    found.append(f"{path.relative_to(ROOT).as_posix()}:{handler.lineno}")
    assert words > 20 and not found


def test_invariant_kernels_index_from_the_start():
    """Invariant: no index of a kernel is written as one that counts from the end, which compiled code would not follow."""
    seen, found = 0, []
    for path in SOURCES:
        for function in ast.walk(parsed(path)):
            if not isinstance(function, ast.FunctionDef) or not any(
                map(KERNEL.match, map(ast.unparse, function.decorator_list))
            ):
                continue
            for node in ast.walk(function):
                if isinstance(node, ast.Subscript):
                    indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
                    seen += len(indices)
                    counted = [ast.unparse(index) for index in indices if isinstance(index, ast.UnaryOp)]
                    found += [f"{path.name}:{node.lineno} {index}" for index in counted]
    assert seen > 500 and not found


# Words that no engineer says, each with what to write instead.
BANNED = {
    r"foret(?:old|ells?|elling)": "predict",
    r"mend(?:s|ed|ing)?": "fix",
    r"what is not known|what nobody told": "unknown inputs",
    r"beside": "next to, compared with",
    r"(?:holds?|held)(?: it| them| the selected design)? back": "limits, limited by",
    r"what manufacture makes of|what its tolerances leave": "at the ends of its tolerances",
    r"so or similarly": "in N of M runs",
    r"gains? with (?:less|more)": "improves as ... decreases",
    r"teach(?:es|ing)?|taught": "identify, training rows",
    r"known together": "identified combination",
    r"unless told|tells? of|told of|nobody told": "given, stated, reported",
    r"stands in no": "is in no",
    r"neither closes? nor tells? why": "failed without a diagnosis",
}
# Words that messages and pages write as others say them; docstrings are exempt.
SPOKEN = {
    r"house|rooms?(?! (?:temperature|for)\b)|doors?": "source layout, package, space",
    r"jitter\w*|trembl\w*": "does not whirl, local cage motion",
    r"rim|fellows?|surer|likeliest|likelier|lopsided|luck\w*|rivals?|opinions?": "bound, alternative, most probable, bias",
    r"makers?": "manufacturer",
    r"may be left out": "optional",
    r"anew": "again",
    r"in place of": "instead of",
    r"go(?:es|ing)? on(?! the drawing)": "continue",
    r"carr(?:y|ies|ied)(?: \w+){0,2} off": "remove",
    r"odds|of a hundred|(?:in|of) 100 cases": "probability, %",
    r"demand(?:s|ed)?": "require",
    r"a (?:row|line) an? \w+": "one row per",
    r"by an estimate": "estimated at",
    r"holds? the (?:truth|true|errors?)": "contains the true value",
    r"as the scene says": "scene values",
    r"what stands|stands? (?:in a|in the|there|together|behind|at a)": "is in, is at, contradict",
    r"the shop|what manufacture|manufacture keeps": "can be manufactured",
}
WORDS = re.compile("|".join(rf"\b(?:{words})\b" for words in BANNED), re.IGNORECASE)


def _texts(path: Path) -> list[tuple[int, str]]:
    """Line and text of every string of a module, its docstrings and pieces of f-strings counted, or of a page of text."""
    if path.suffix != ".py":
        return list(enumerate(path.read_text(encoding="utf-8").splitlines(), 1))
    return [
        (node.lineno, node.value)
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and not NAME.fullmatch(node.value)
    ]


def test_invariant_words_are_those_of_the_field():
    """Invariant: no message, docstring or page has a word that the glossary replaces; public keys and names are exempt."""
    assert all(
        WORDS.search(each)
        for each in ("the selected design foretold", "Mend it", "so or similarly 8 runs", "held back")
    )
    read, found = 0, []
    tables = (path for package in ("rbdyn", "doe") for path in (ROOT / package).rglob("*.toml"))
    for path in [*SOURCES, *PAGES, *TOP_PAGES, *(path for path in tables if path.name != "measured.toml")]:
        for line, text in _texts(path):
            read += 1
            for each in WORDS.finditer(QUOTED.sub("", text)):
                place = line + text.count("\n", 0, max(text.find(each.group()), 0))
                found.append(f"{path.relative_to(ROOT).as_posix()}:{place} {each.group()}")
    assert read > 10_000 and not found, "\n".join(found)


def test_invariant_messages_and_pages_use_plain_words():
    """Invariant: no message, label, page or comment of an example has a word that a reader stumbles over; code and names are exempt."""
    words = re.compile("|".join(rf"\b(?:{words})\b" for words in SPOKEN), re.IGNORECASE)
    assert all(words.search(text) for text in ("the likeliest pick", "A row a run.", "it goes on", "by luck"))
    read, found = 0, []
    for path in [*SOURCES, *PAGES, *TOP_PAGES, *EXAMPLES]:
        text = path.read_text(encoding="utf-8")
        whole = "\n".join(comments(text)) if path in EXAMPLES else without_code(text)
        texts = messages(path) if path.suffix == ".py" else [(1, whole)]
        for line, text in texts:
            read += 1
            if not NAME.fullmatch(text) and not re.fullmatch(r"[\w-]+", text):
                found += [
                    f"{path.relative_to(ROOT)}:{line} {each.group()}" for each in words.finditer(QUOTED.sub("", text))
                ]
    assert read > 10_000 and not found, "\n".join(found)


# Words of a sentence that a reader takes in at once.
LONGEST_SENTENCE = 30


def _long_sentences(text: str) -> list[str]:
    """Sentences of a text with more words than a reader takes in at once; numbers and signs are no words."""
    sentences = (part for part in SENTENCE_END.split(text) if not SQL.match(text))
    return [part for part in sentences if len(words_of(part)) > LONGEST_SENTENCE]


def test_invariant_messages_are_short_sentences():
    """Invariant: no sentence of a message, label, note or description of a key has more than 30 words, and no colon or semicolon ends one; SQL is exempt."""
    assert (
        _long_sentences("a word; " * 16)
        and not _long_sentences("a word 1 - " * 15)
        and not _long_sentences("SELECT a " * 20)
    )
    read, long = 0, []
    for path in SOURCES:
        for line, text in messages(path):
            read += 1
            name = path.relative_to(ROOT).as_posix()
            long += [f"{name}:{line}: {' '.join(sentence.split())}" for sentence in _long_sentences(text)]
    assert read > 10_000 and not long, "\n".join(long)


# Shapes that make a sentence hard to read, each with the most that messages and keys, docstrings, and pages with comments of
# examples may have. Counts may only fall.
SHAPES = {
    r"\b(?:that|those) of\b": (2, 317, 0),
    r"(?<![.?!] )\bwhat (?:the|a|its|it|they|is|are|was|stands?|fits|few|follows|goes)\b": (0, 145, 0),
    r", for (?:it|they|this|no|any|its|there|those|free|then)\b": (0, 14, 0),
    r"(?:^|[.!?] )So\b(?! that)|\band so (?:has|is|are|does)\b": (0, 35, 0),
    r"\b(?:is|are) no (?!longer|more|less|equilibrium|steady)\w+": (0, 54, 0),
    r"(?:^|[.!?] )(?:It|They|This|That|These|Those) (?:is|are|has|does|can|needs?|takes?|shows?)\b": (1, 56, 0),
    r"(?:\bof\b[^.!?]*){4}": (1, 153, 0),
    r"(?:;[^.!?;]*){2}": (13, 154, 0),
    r"\bplay\b": (0, 17, 0),
    r"(?<!-)\braces?\b(?!\.|-)": (2, 190, 0),
    r"(?<![<{/-])\b[Ff]igures?\b(?![}>])": (0, 274, 0),
    r"(?<!\.)\b[Pp]icks?\b(?! =)": (1, 204, 0),
}


def _shapes_of(texts: list[tuple[str, int, str]], shape: str) -> list[str]:
    """Places of a shape in texts, with the words around; code, names and SQL are exempt."""
    found = []
    for name, line, text in texts:
        if not (SQL.match(text) or NAME.fullmatch(text) or re.fullmatch(r"[\w-]+", text)):
            plain = " ".join(QUOTED.sub("", text).split())
            found += [
                f"{name}:{line} {plain[max(each.start() - 30, 0) : each.end() + 30]}"
                for each in re.finditer(shape, plain)
            ]
    return found


def test_invariant_hard_shapes_of_sentences_get_fewer():
    """Invariant: no shape that is hard to read occurs more often in messages, docstrings, and pages with examples than is stated."""
    sides = []
    for read in (messages, docstrings):
        sides.append([(str(path.relative_to(ROOT)), line, text) for path in SOURCES for line, text in read(path)])
    texts = ((path.name, paragraphs(path.read_text(encoding="utf-8"))) for path in [*PAGES, *TOP_PAGES])
    notes = ((path.name, comments(path.read_text(encoding="utf-8"))) for path in EXAMPLES)
    sides.append([(name, 1, text) for name, page in (*texts, *notes) for text in page])
    assert all(len(side) > least for side, least in zip(sides, (3000, 3000, 300), strict=True))
    assert _shapes_of([("", 1, "that of its inputs, for no input is known")], "|".join(list(SHAPES)[:3]))
    excess = []
    for shape, most in SHAPES.items():
        for side, limit in zip(sides, most, strict=True):
            found = _shapes_of(side, shape)
            excess += [f"{shape}: {len(found)}, more than {limit}", *found] if len(found) > limit else []
    assert not excess, "\n".join(excess)


def test_invariant_the_citation_is_of_this_version():
    """Invariant: CITATION.cff states version and licence of pyproject.toml; the manual cites its title and version."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    assert {f"version: {project['version']}", f"license: {project['license']}"} <= set(lines)
    title = next(line for line in lines if line.startswith("title: ")).removeprefix("title: ").strip('"')
    page = (ROOT / "rbdyn" / "cli" / "manual" / "prose" / "73_references.md").read_text(encoding="utf-8")
    assert f"{title}. Version {project['version']}." in page
