"""What the programs, their manual and the README say: messages, docstrings and running text, sentence by sentence."""

import ast
import functools
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCES = [path for package in ("rbdyn", "doe") for path in (ROOT / package).rglob("*.py")]
PAGES = [path for package in ("rbdyn", "doe") for path in (ROOT / package).rglob("*.md")]
TOP_PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
# Scenes and studies with comments: examples, and the templates of new ones.
EXAMPLES = [path for folder in ("examples", "rbdyn/draft", "doe/commands") for path in (ROOT / folder).glob("*.toml")]
# Names and public keys, which stay: whole constants of one word, and what stands in backticks or quotes.
NAME = re.compile(r"\w+|[\w./]+\.csv")
QUOTED = re.compile(r"class=\"\w+\"|``.*?``|`[^`\n]*`|https?://\S+")
SQL = re.compile(r"\s*(?:SELECT|INSERT|UPDATE|DELETE|CREATE|PRAGMA|WITH)\b")
# Where a sentence ends; a colon or a semicolon ends none.
SENTENCE_END = re.compile(r"(?<=[.!?])\s+|\n\s*\n|\n\s*[-*] ")
OWNERS = (ast.Module, ast.ClassDef, ast.FunctionDef)
# Words without which a clause is none: finite verbs of the texts, and imperatives. Forms that are nouns as often are left out.
VERBS = re.compile(
    r"\b(?:is|are|was|were|be|has|have|had|does|do|did|can|cannot|may|might|must|will|would|should|needs?|accepts?|acts?|adds?|"
    r"allows?|answers?|appl(?:y|ies)|asks?|assumes?|averages?|begins?|belongs?|calculates?|calibrates?|carry|carries|causes?|changes?|"
    r"checks?|chooses?|closes?|combines?|comes?|compares?|computes?|conducts?|confirms?|contains?|continues?|contradicts?|costs?|"
    r"counts?|covers?|creates?|decides?|decreases?|defines?|depends?|describes?|differs?|drives?|drops?|ends?|enters?|excludes?|"
    r"explains?|falls?|favours?|feeds?|filters?|finds?|follows?|fits|floods?|forms?|gets?|gives?|goes|grows?|halves?|holds?|"
    r"improves?|includes?|increases?|integrates?|interacts?|joins?|keeps?|leaves?|lets?|lies|limits?|lists?|looks?|makes?|marks?|"
    r"means?|meets?|misses|moves?|names?|occurs?|omits?|opens?|overestimates?|plots?|predicts?|prints?|proposes?|pushes|raises?|"
    r"ranks?|reaches|reads?|reduces?|refers?|relieves?|removes?|repeats?|replaces?|reports?|requires?|rests?|returns?|rises?|runs?|"
    r"satisf(?:y|ies)|says?|scans?|scatters?|seizes?|selects?|separates?|sets?|shows?|simulates?|starves?|states?|stays?|stops?|"
    r"sums?|take|takes|tests?|treats?|turns?|use|uses|vary|varies|violates?|warms?|warns?|widens?|withstands?|works?|writes?|"
    r"printed|suggests?|heat the|fails?|failed|gave|took|knows?|knew|determines?|draws?|solves?|settles?|slips? (?:by|more)|starts?|saves?|go|help|miss|"
    r"lie|reach|places|pays|becomes?|disagrees?|compiles?|narrow|fit|points? (?:along|at)|multiplies|expects?|equals?|agrees?|exceeds?|excite|bends?|lead|loses?|estimates?|matters?)\b",
    re.IGNORECASE,
)


@functools.cache
def parsed(path: Path) -> ast.Module:
    """The syntax tree of a module, which several tests walk."""
    return ast.parse(path.read_text(encoding="utf-8"))


def spoken(node: ast.AST) -> str | None:
    """The text of a string or f-string, in which each value is one word X; None for anything else."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(piece.value) if isinstance(piece, ast.Constant) else "X" for piece in node.values)
    return None


def messages(path: Path) -> list[tuple[int, str]]:
    """Line and text of each string and f-string of a module that is no docstring."""
    tree = parsed(path)
    silent = {id(node.body[0].value) for node in ast.walk(tree) if isinstance(node, OWNERS) and _opens_with_text(node)}
    silent |= {id(piece) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for piece in node.values}
    found = ((node, spoken(node)) for node in ast.walk(tree) if id(node) not in silent)
    return [(node.lineno, text) for node, text in found if text is not None]


def _opens_with_text(node: ast.Module | ast.ClassDef | ast.FunctionDef) -> bool:
    """Whether the first statement is a bare expression, as a docstring is."""
    return bool(node.body) and isinstance(node.body[0], ast.Expr)


def docstrings(path: Path) -> list[tuple[int, str]]:
    """Line and text of each docstring of a module; those of keys are messages."""
    owned = (node for node in ast.walk(parsed(path)) if isinstance(node, OWNERS))
    return [(node.body[0].lineno, text) for node in owned if (text := ast.get_docstring(node))]


def notes(path: Path) -> list[tuple[int, str]]:
    """Line and text of each note of a module: what is handed to ``Note``, there or by a name of the same function."""
    found = []
    for function in (node for node in ast.walk(parsed(path)) if isinstance(node, ast.FunctionDef)):
        named: dict[str, list[ast.expr]] = {}
        for node in ast.walk(function):
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                named.setdefault(node.targets[0].id, []).append(node.value)
        for node in ast.walk(function):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "Note" and len(node.args) == 2:
                text = node.args[1]
                values = named.get(text.id, []) if isinstance(text, ast.Name) else [text]
                found += [(value.lineno, said) for value in values if (said := spoken(value))]
    return found


def comments(table: str) -> Iterator[str]:
    """Comments of a TOML file, those in lines of their own as one text."""
    found = [re.findall("(.*?)# (.*)", line) for line in table.splitlines()]
    yield " ".join(after for each in found for before, after in each if not before.strip())
    yield from (after for each in found for before, after in each if before.strip())


def without_code(page: str) -> str:
    """A page of Markdown without its blocks of code."""
    return re.sub(r"^```.*?^```$", "", page, flags=re.MULTILINE | re.DOTALL)


def paragraphs(page: str) -> Iterator[str]:
    """Paragraphs and entries of lists of a page of Markdown, each in one line; what is in backticks is one word X."""
    for block in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )", without_code(page)):
        if block.strip() and not block.lstrip().startswith(("#", "|", "!", ">")):
            yield " ".join(re.sub(r"`[^`]*`", "X", block).split())


def sentences(page: str) -> Iterator[str]:
    """Sentences of the running text of a page; labels in bold, leads to code and entries of lists are none."""
    for paragraph in paragraphs(page):
        paragraph = re.sub(r"\*\*[^*]+[.:]\*\*", "", paragraph)
        for sentence in re.split(r"(?<=[.!?])[\"*]*\s+(?=[\"*X\[A-Z])", paragraph):
            if re.search(r"[.!?][\"*)]*$", sentence):
                yield sentence


def words_of(text: str) -> list[str]:
    """Words of a text; numbers and signs are no words."""
    return re.findall(r"\S*[A-Za-z]\S*", text)
