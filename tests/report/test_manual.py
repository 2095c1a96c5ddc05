"""``rbdyn manual``: every key, command, equation and public name is there, and what its prose names exists."""

import ast
import importlib
import json
import math
import os
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from manual_parts import ROOT, declared, parts, whole_page
from short_studies import EXAMPLES

import rbdyn
from rbdyn.cli.manual.page import DIVISIONS, FOLDED, markdown, rendered, roller_bearing, scene_of
from rbdyn.plots.sketches import clearances
from rbdyn.quasistatic.sweep import SWEEPS, sweep
from rbdyn.scene import Scene
from rbdyn.scene.keys import keys, lines

# A command with its options, as prose and code write it.
CALL = re.compile(r"\b(rbdyn|doe) (?!=)([a-z]+)\b((?: [^\s`|]+)*)")
VOID = {"meta", "input"}
# Pages that are lists.
LISTS = {"61_glossary.md"}
# What speaks to the reader: "you", or an imperative at the start of a sentence or an entry.
ADDRESS = re.compile(
    r"\byour?\b|(?:^|[.!?:] )\W*(?:Add|Check|Choose|Compare|Confirm|Edit|Expect|Fit|Give|Increase|Lengthen|Look|Lower|Move|Name|"
    r"Narrow|Open|Raise|Read|Reduce|Relax|Replace|Run|Set|Start|State|Suppose|Take|Use|Wait|Write)\b",
    re.MULTILINE,
)
SPEED = "operation.inner_speed_rpm"


class Read(HTMLParser):
    """Keys, links, sources and headings of a page, its text, and elements that are left open."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.keys: list[str] = []
        self.links: list[str] = []
        self.sources: list[str] = []
        self.headings: list[str] = []
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(text)
        self.text = " ".join("".join(self.words).split())

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.keys += [found["id"]] if "id" in found else []
        self.links += [found["href"]] if "href" in found else []
        self.sources += [found["src"]] if "src" in found else []
        self.open += [] if tag in VOID else [tag]
        self.headings += [""] if re.fullmatch("h[1-6]", tag) else []

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            self.words.append(data)
        if any(re.fullmatch("h[1-6]", tag) for tag in self.open):
            self.headings[-1] += data


@pytest.fixture(scope="module")
def floors():
    """The parts of both packages."""
    return parts()


@pytest.fixture(scope="module")
def manual():
    """The page, read."""
    return Read(whole_page())


def test_page_is_whole_and_needs_nothing_else(manual):
    """Report: one file; every link of it leads to a place on it; nothing is left open or to be filled in."""
    assert manual.open == [] and manual.sources == []
    assert len(set(manual.keys)) == len(manual.keys)
    assert {link for link in manual.links if not link.startswith("#")} == set()
    assert {link[1:] for link in manual.links} <= set(manual.keys)
    assert "{{" not in manual.text


def test_drawings_are_of_the_scene_and_describe_themselves(manual):
    """Report: four inline drawings with words for those who do not see them; sizes in the captions are those of the scene."""
    scene, page = roller_bearing(), whole_page()
    pictures = re.findall(
        r'<figure><svg role="img" aria-label="([^"]{60,})"[^>]*>.*?</svg><figcaption>', page, re.DOTALL
    )
    assert len(pictures) == page.count("<svg class") + page.count("<svg role") == 4
    for words in (
        f"radial clearance, {scene.bearing.radial_clearance_mm:g} mm on the diameter",
        f"pocket clearance, {scene.cage.pocket_clearance_mm:g} mm, half of it at each wall",
        f"closing link: radial clearance {scene.bearing.radial_clearance_mm:g}",
        "times as wide. Rollers and cage are drawn smaller.",
        "a contact angle α of 40°",
    ):
        assert words in manual.text, words


@pytest.mark.parametrize("options", [{"--guidance": "inner"}, {"--clearance": "C2"}, {"--guidance": "roller"}])
def test_clearances_are_drawn_of_other_bearings(options):
    """Report: a gap of each clearance that the bearing has, between the bodies that it separates; none without a land."""
    svg, caption = clearances(Scene.from_dict(scene_of("NU1010", options), "scene"))
    gaps = re.findall(r'class="measure" points="([-\d.]+),([-\d.]+) ([-\d.]+),([-\d.]+)"', svg)
    lengths = [math.dist((float(a), float(b)), (float(c), float(d))) for a, b, c, d in gaps]
    landless = options.get("--guidance") == "roller"
    assert len(lengths) == (4 if landless else 5) and min(lengths) > 5.0
    assert ("guide clearance" in caption) == (not landless)


def test_every_key_is_told(manual, floors):
    """Report: name, unit, range, default and meaning of each key that the keys commands know."""
    found = [key for part in floors for key in keys(part.kinds)]
    assert len(found) > 300
    for key in found:
        assert key.key in manual.headings, key.key
        told = lines(key)[0].removeprefix(f"{key.key}: ")
        assert f"{key.key} {told} {key.description}" in manual.text, key.key


def test_every_command_is_told_with_its_options(manual, floors):
    """Report: usage, what it does and every option of each command of both programs."""
    told = 0
    for part in floors:
        for name, command in part.commands.commands.items():
            assert f"{part.package} {name}" in manual.headings
            assert " ".join(command.help.split()) in manual.text
            for option in command.params:
                if option.param_type_name == "option":
                    says = rf"{option.opts[0]}\b.{{0,40}}: {re.escape(option.help[:30])}"
                    assert re.search(says, manual.text), says
                    told += 1
    assert told > 60


def test_every_module_with_an_equation_is_there(manual):
    """Report: a module whose docstring, or that of anything in it, has an equation or a source stands there with it."""
    told = 0
    for path in [path for package in ("rbdyn", "doe") for path in (ROOT / package).rglob("*.py")]:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        named = [node for node in ast.walk(tree) if isinstance(node, ast.ClassDef | ast.FunctionDef)]
        texts = {getattr(node, "name", ""): ast.get_docstring(node) or "" for node in (tree, *named)}
        if any(" = " in text or re.search("Sources?: ", text) for text in texts.values()):
            module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            assert module in manual.headings
            assert Read(rendered(f"# x\n\n{markdown(texts[''])}", "x")[1]).text.removeprefix("x") in manual.text
            told += 1
    assert told > 60
    for words in (
        "(k^2+1) E - 2 K)/[(k^2-1) E] = F",
        "F_R/(E' R l) = 1.42 sqrt(U W)/(1 + r^10)^0.1",
        "boundary: float # mu_b [-]",
    ):
        assert words in manual.text


def test_every_public_name_is_told(manual):
    """Report: what the packages hand on, with what it says of itself; methods that a class inherits too."""
    for name in rbdyn.__all__:
        assert f"rbdyn.{name}" in manual.headings
    for package in ("doe.designs", "doe.response_surface", "doe.pareto", "doe.dimension_chain", "doe.study_file"):
        home = importlib.import_module(package)
        tree = ast.parse(Path(home.__file__).read_text(encoding="utf-8"))
        names = [alias.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names]
        assert names
        for name in names:
            first = getattr(home, name).__doc__.split("\n\n")[0].replace("`", "")
            assert any(heading.endswith(f".{name}") for heading in manual.headings), name
            assert " ".join(first.split()) in manual.text, name
    for words in ("table(self) -> pd.DataFrame: A row a figure", "save(self, path: Path | str) -> None: Write JSON"):
        assert words in manual.text


def test_prose_names_commands_and_options_that_exist(floors):
    """Report: every command that prose or README names is one, with the options that stand behind it."""
    known = {part.package: part.commands.commands for part in floors}
    prose = [path for part in floors for path in part.prose.glob("*.md")]
    calls = 0
    for path in [ROOT / "README.md", ROOT / "examples" / "measured.md", *prose]:
        code = re.findall(r"```sh\n(.*?)```", text := path.read_text(encoding="utf-8"), re.DOTALL)
        for program, name, rest in CALL.findall("\n".join((*code, *re.findall("`([^`]+)`", text)))):
            assert name in known[program], f"{path.name}: {program} {name}"
            options = {each for option in known[program][name].params for each in option.opts}
            for option in re.findall(r"(?<!\S)--?[a-z][a-z-]*", rest):
                assert option in options, f"{path.name}: {program} {name} {option}"
            calls += 1
    assert calls > 30


def test_glossary_is_in_order_and_short(floors):
    """Report: terms in alphabetical order, each in at most two sentences without the name of a module."""
    text = (floors[0].prose / "61_glossary.md").read_text(encoding="utf-8")
    entries = [entry.partition("\n")[::2] for entry in text.split("\n### ")[1:]]
    terms = [term for term, _ in entries]
    assert len(terms) > 30 and terms == sorted(terms, key=str.lower)
    for term, says in entries:
        assert 1 <= len(re.findall(r"\.(?:\s|$)", says)) <= 2 and not re.search(r"\b(?:rbdyn|doe)\.", says), term


def prose_of(path):
    """Running text of a page: no code, tables, headings or pictures; what is in backticks is one word."""
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    return re.sub(
        "`[^`\n]*`", "X", "\n".join(line for line in text.splitlines() if not line.startswith(("|", "#", "![")))
    )


def test_prose_speaks_to_an_engineer(floors):
    """Report: per 1000 words of running text at most 30 "of", 18 pronouns and 4 semicolons; each how-to and tutorial speaks to the reader."""
    pages = {path.name: prose_of(path) for part in floors for path in part.prose.glob("*.md")}
    text = "\n".join(pages.values())
    words = len(re.findall(r"\S*[A-Za-z]\S*", text))
    for pattern, most in ((r"\bof\b", 30), (r"\b(?:it|they|its|their|these|those)\b", 18), (";", 4)):
        assert 0 < 1000 * len(re.findall(pattern, text, re.IGNORECASE)) / words <= most, pattern
    guided = {name: page for name, page in pages.items() if "20" <= name < "50"}
    assert len(guided) > 15
    assert [name for name, page in guided.items() if 1000 * len(ADDRESS.findall(page)) / len(page.split()) < 3] == []


def test_pages_have_the_form_of_their_division(floors):
    """Report: pages are short; a how-to begins with when it is for and shows a command; pages that are named exist."""
    paths = sorted((path for part in floors for path in part.prose.glob("*.md")), key=lambda path: path.name)
    titles = {path.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ").replace("`", "") for path in paths}
    numbers = [path.name[:2] for path in paths]
    assert len(titles) == len(set(numbers)) == len(paths) and {number[0] for number in numbers} == set("12345678")
    for path in paths:
        text = path.read_text(encoding="utf-8")
        rest = text.split("\n\n")[1]
        assert re.match(r"[A-Z\"`].*[.:]$", rest, re.DOTALL), path.name
        if "30" <= path.name < "50":
            assert rest.startswith("Use this when ") and "```sh\n" in text and "\nSee also: " in text, path.name
        if path.name not in LISTS:
            assert len(prose_of(path).split()) <= 950, path.name
        for named in re.findall('"([^"]+)"', "".join(re.findall(r"See also: .*", text))):
            assert named.replace("`", "") in titles, f"{path.name}: {named}"


def test_parts_are_in_the_contents():
    """Report: the contents have the divisions in order, each with its chapters; equations and signatures are folded."""
    page = whole_page()
    contents = page.split('<details id="contents"')[1].split("</nav>")[0]
    found = re.findall("<strong>(.*?)</strong><ol>(.*?)</ol></li>", contents, re.DOTALL)
    assert [name for name, _ in found] == list(DIVISIONS.values())
    assert all(
        len(re.findall(r'class="l1"', entries)) >= least
        for (_, entries), least in zip(found, (1, 3, 10, 5, 8), strict=True)
    )
    for name in FOLDED:
        section = page.split(f'<section aria-labelledby="{name}">')[1].split("</section>")[0]
        assert section.count("<details><summary><h4") == section.count("<h4") > 10


def test_every_question_has_a_command_and_a_figure(floors):
    """Report: each row of the page of questions names a command; the other test checks that it exists with its options."""
    text = (floors[0].prose / "30_questions.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1:-1] for line in text.splitlines() if line.startswith("| ") and "| question |" not in line]
    assert len(rows) > 30
    for question, command, figure in rows:
        assert question.strip().endswith("?") and CALL.search(command) and figure.strip(), question


def test_every_column_of_a_sweep_is_described():
    """Report: columns of sweeps of one row and of two, with and without a heat balance, have a meaning in the manual."""
    named = {re.sub(r"^\{key\}$", SPEED, key) for key in SWEEPS.keys}
    for scene in ("angular_contact_ball.toml", "double_decker.toml"):
        table = sweep(EXAMPLES / scene, {SPEED: [1000.0, 2000.0]}).table()
        columns = {re.sub("^(inner|outer)_row_", "", name) for name in table}
        assert columns <= named, scene


@pytest.mark.slow
def test_command_writes_the_page_and_nothing_else(tmp_path, command):
    """Command line: the declared entry points bring both floors in; the note of what made it stands next to it; equal bytes in any process; one JSON object."""
    meta = tmp_path / f"rbdyn-{rbdyn.__version__}.dist-info"
    meta.mkdir()
    (meta / "METADATA").write_text(f"Metadata-Version: 2.1\nName: rbdyn\nVersion: {rbdyn.__version__}\n")
    lines = "\n".join(f"{name} = {value}" for name, value in declared().items())
    (meta / "entry_points.txt").write_text(f"[rbdyn.manual]\n{lines}\n")
    where = os.pathsep.join((str(tmp_path), str(ROOT)))
    ran = command("manual", "--out", tmp_path / "out", "--json", PYTHONPATH=where, PYTHONHASHSEED="7")
    assert ran.returncode == 0, ran.stderr
    assert json.loads(ran.stdout) == {"status": "ok", "page": str(tmp_path / "out" / "manual.html")}
    assert sorted(os.listdir(tmp_path / "out")) == ["made_by.json", "manual.html"]
    assert (tmp_path / "out" / "manual.html").read_text(encoding="utf-8") == whole_page()


def test_command_refuses_a_file_for_a_folder(tmp_path, command):
    """Command line: one sentence with the mend, exit code 2."""
    (tmp_path / "taken").write_text("")
    ran = command("manual", "--out", tmp_path / "taken")
    assert ran.returncode == 2
    assert len(ran.stderr.splitlines()) == 1 and "cannot be written to (Not a directory)" in ran.stderr


def test_readme_is_short_and_leads_somewhere():
    """Report: at most 100 lines, short outside tables and code; one command each to run and to test; links and map are true."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    prose = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    assert len(text.splitlines()) <= 100 and all(len(line) <= 100 for line in prose.splitlines() if line[:1] != "|")
    rows = re.findall(r"^\|(.*)\|$", text.split("## Measured")[1], re.MULTILINE)
    assert all(len(cell) <= 110 and ";" not in cell for row in rows for cell in row.split("|"))
    for title in ("Run", "Test"):
        section = text.split(f"\n## {title}\n")[1].split("\n## ")[0]
        assert len(re.findall(r"^```sh\n[^\n]+\n```$", section, re.MULTILINE)) == section.count("```") / 2 == 1
    links = re.findall(r"\]\(([^)]+)\)", text)
    guide = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rooms = re.findall("`([a-z_/.]+)`", guide.split("## Source map")[1].split("\n## ")[0])
    for place in [*links, *(room for room in rooms if "/" in room)]:
        assert (ROOT / place).exists(), place
    for room in (room for room in rooms if "/" not in room):
        assert [*ROOT.glob(f"*/{room}"), *ROOT.glob(f"*/*/{room}")], room
    parts_named = re.findall(r"\| `([a-z]+)` \|$", text, re.MULTILINE)
    page_parts = (ROOT / "examples" / "measured.md").read_text(encoding="utf-8")
    assert len(parts_named) > 5 and all(f"<!-- {name} -->" in page_parts for name in parts_named)


def test_numbers_of_the_readme_are_those_of_their_part():
    """Report: each number of a measured row of the README is one of its part of measured.md, to the digits that are stated."""
    table = (ROOT / "README.md").read_text(encoding="utf-8").split("## Measured")[1]
    page = (ROOT / "examples" / "measured.md").read_text(encoding="utf-8")
    number, checked = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[-+]\d+)?(?![\w.]*\d)"), 0
    for result, name in re.findall(r"\| ([^|]+) \| `([a-z]+)` \|$", table, re.MULTILINE):
        part = page.split(f"<!-- {name} -->")[1].split(f"<!-- /{name} -->")[0]
        measured = [float(text) for text in number.findall(part)]
        for text in number.findall(result):
            decimals = len(text.partition(".")[2])
            assert any(abs(value - float(text)) <= 0.51 * 10.0**-decimals for value in measured), (name, text)
            checked += 1
    assert checked > 12
