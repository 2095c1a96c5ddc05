"""Fuzz: designations and options of ``rbdyn new`` are honoured in the scene, or refused in sentences of one bounded line."""

import random
import re
import tomllib
import warnings

import numpy as np
import pytest
from typer.testing import CliRunner

from rbdyn.base.faults import LONGEST_SENTENCE
from rbdyn.cli.app import app
from rbdyn.properties import table
from rbdyn.scene import Scene

# What a suffix must leave in the scene, by kind of bearing: dotted key and value; a class of clearance; or nothing.
CLASSES = {name: name for name in ("C2", "CN", "C3", "C4", "C5")}
IDLE = ("P6", "P5", "P4", "S0", "S1", "NR", "W33")
CAGES = {"MA": ("outer", "brass"), "MB": ("inner", "brass"), "M": ("roller", "brass"), "ECM": ("roller", "brass"), "J": ("roller", "aisi_4340"),
         "ECP": ("roller", "soft"), "TVP2": ("roller", "soft"), "ECPHA": ("outer", "peek")}  # fmt: skip
ANGLES = {"C": 15.0, "AC": 25.0, "A5": 25.0, "A": 30.0, "B": 40.0, "BEP": 40.0, "ACD": 25.0, "CE": 15.0}
SEALS = ("2RS", "ZZ", "2Z", "2RS1", "DDU")
UNKNOWN = (
    "SECRET",
    "C1",
    "C9",
    "V",
    "HC5",
    "DB",
    "MT33",
    "C3H",
    "CM",
    "X",
    "\x01",
    "é",
    '"',
    "#",
    "=",
    "9" * 30,
    "A" * 300,
)
SERIES = {"NU": ("10", "2", "22", "3", "23"), "NJ": ("2", "3"), "N": ("10", "2"), "6": ("0", "2", "3", "18", "19"),
          "7": ("0", "2", "3", "18", "19"), "8": ("2",), "NA": ("49",)}  # fmt: skip
CODES = (*(f"{code:02d}" for code in range(0, 30)), "99", "5", "")
LIKELY = {"--speed": (1.0, 20000.0), "--load": (1.0, 1e5), "--preload": (1.0, 5000.0), "--temperature": (-20.0, 150.0)}
EXTREMES = (
    "0", "-1", "nan", "inf", "-inf", "1e400", "1e300", "1e-300", "-300", "343", "1e7", "0.001", "1", "2000", "x", "",
)  # fmt: skip
OILS = (
    "ISO VG 32", "VG 15 PAO", "grease VG 100", "23699", "Jet Oil II", "VG 0", "VG 99999", "castor",
    "ISO VG " + "9" * 5000,
)  # fmt: skip
KEYS = {"--speed": "inner_speed_rpm", "--load": "radial_load_N", "--preload": "preload_N"}


def drawn(random: random.Random) -> tuple[list[str], list[str], dict[str, str]]:
    """Arguments of a designation, its suffixes, and options."""
    letter = random.choice(("NU", "NU", "NJ", "N", "6", "6", "7", "7", "8", "NA"))
    size = letter + random.choice(("", "", " ", "-")) * (letter[0] == "N") + random.choice(SERIES[letter])
    size += random.choice(CODES[4:21] if random.random() < 0.8 else CODES)
    usual = [*CLASSES, *IDLE, *{"6": SEALS, "7": (*ANGLES, *SEALS)}.get(letter, CAGES)]
    suffixes = [
        random.choice(UNKNOWN) if random.random() < 0.05 else random.choice(usual)
        for _ in range(random.choice((0, 1, 1, 2, 3)))
    ]
    text = size + "".join(random.choice((" ", "/", "-", ".", "  ")) + suffix for suffix in suffixes)
    options = {
        name: f"{random.uniform(*LIKELY[name]):.4g}" if random.random() < 0.8 else random.choice(EXTREMES)
        for name in LIKELY
        if random.random() < (0.1 if name == "--preload" and letter[0] == "N" else 0.4)
    }
    if random.random() < 0.15:
        options["--clearance"] = random.choice((*CLASSES, "c3", "C1", "x"))
    if random.random() < 0.3:
        options["--oil"] = random.choice(OILS[:5] if random.random() < 0.7 else OILS)
    if random.random() < 0.25:
        bore = 10.0 ** random.uniform(0.0, 3.3)
        outside, width = bore * (1.0 + 10.0 ** random.uniform(-4.0, 0.6)), bore * 10.0 ** random.uniform(-2.0, 0.5)
        sizes = (f"{value:.6g}" for value in (bore, outside, width))
        options |= dict(zip(("--bore", "--outside", "--width"), sizes, strict=True))
        if random.random() < 0.2:
            options[random.choice(("--bore", "--outside", "--width"))] = random.choice(EXTREMES)
    return text.split() if random.random() < 0.5 else [text], suffixes, options


def check_scene(text: str, arguments: list[str], suffixes: list[str], options: dict[str, str]) -> None:
    """Every suffix and every option stands in the scene, and none contradicts another."""
    scene = tomllib.loads(text)
    assert not getattr(Scene.from_dict(scene, "new"), "unit_notes", ())
    letters, bare = (re.sub(r"[\s/.,-]", "", part).upper() for part in ("".join(arguments), text.partition(",")[0][1:]))
    assert bare == letters
    assert not set(suffixes) & set(UNKNOWN), "unknown suffixes are refused"
    kind, operation = scene["bearing"]["kind"], scene["operation"]
    classes = {CLASSES[suffix] for suffix in suffixes if suffix in CLASSES}
    if "--clearance" in options:
        classes.add(options["--clearance"].upper())
    assert len(classes) <= (kind != "angular_contact_ball")
    if kind != "angular_contact_ball":
        name = (*classes, "CN")[0]
        bore = float(text.partition(",")[2].split()[0])
        row = next(row for row in table("clearance_classes") if row["kind"] == kind and bore <= float(row["bore"]))
        middle = 5e-4 * (float(row[f"{name}_min"]) + float(row[f"{name}_max"]))
        assert scene["bearing"]["radial_clearance_mm"] == pytest.approx(middle, abs=6e-5)
    else:
        angles = [ANGLES[suffix] for suffix in suffixes if suffix in ANGLES]
        assert len(angles) <= 1 and (not angles or scene["bearing"]["contact_angle_deg"] == angles[0])
    cages = [CAGES[suffix] for suffix in suffixes if suffix in CAGES]
    if cages and kind == "cylindrical_roller":
        material = scene["materials"]["cage"]
        assert cages == [(scene["cage"]["guidance"], material if isinstance(material, str) else "soft")]
    for option, key in KEYS.items():
        assert option not in options or operation[key] == float(options[option])
    if "--temperature" in options:
        assert scene["lubricant"]["temperature_C"] == float(options["--temperature"])
    if "--bore" in options:
        sizes = (f"{float(options[option]):g}" for option in ("--bore", "--outside", "--width"))
        assert f", {' x '.join(sizes)} mm" in text.partition("\n")[0]
    idle = text.split("\n")[1] if "Suffixes" in text.split("\n")[1] else ""
    assert all(suffix in idle for suffix in suffixes if suffix in (*IDLE, *SEALS))


@pytest.mark.slow
def test_designations_are_honoured_or_refused_in_sentences(fuzz_cases):
    """Fuzz: random series, bore codes, suffixes and options; each stands in the scene, or a sentence refuses it."""
    random_, runner, ends = random.Random("designations"), CliRunner(), []
    for number in range(fuzz_cases):
        arguments, suffixes, options = drawn(random_)
        command = ["new", *(part for pair in options.items() for part in pair), "--", *arguments]
        with warnings.catch_warnings(), np.errstate(all="raise"):
            warnings.simplefilter("error")
            ended = runner.invoke(app, command)
        where = f"case {number}: {command}\n{ended.output}"
        assert ended.exception is None or isinstance(ended.exception, SystemExit), where
        assert ended.exit_code in (0, 2), where
        ends.append(ended.exit_code)
        if ended.exit_code == 0:
            try:
                check_scene(ended.stdout, arguments, suffixes, options)
            except BaseException as error:
                error.add_note(where)
                raise
        elif "Usage:" not in ended.stderr:
            lines = ended.stderr.splitlines()
            assert lines and not ended.stdout, where
            assert all(line.isprintable() and 20 < len(line) <= LONGEST_SENTENCE for line in lines), where
    assert min(ends.count(0), ends.count(2)) > len(ends) // 20, ends
