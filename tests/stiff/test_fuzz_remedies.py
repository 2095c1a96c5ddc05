"""Fuzz: what a refused chain is told to write is accepted once it is written."""

import random
import re
from collections import Counter

import pytest

from doe.dimension_chain import Chain, ChainResult, solve
from doe.dimension_chain.reading import faults

COUNT = 150
CLASSES = re.compile(r'selective = \{ first = "(\w+)", second = "(\w+)", classes = (\d+) \}')
MORE_CLASSES = re.compile(r"Write classes = (\d+) under selective")
WIDER = re.compile(r"widen the limits to more than (-?[\d.]+) to (-?[\d.]+) mm")


def random_chain(draw: random.Random) -> Chain:
    """Two to five links with deviations or without, perhaps a function, in any mode, often too wide for the limits."""
    links, stated, reach = [], draw.random() < 0.6, 0.0
    for name in "abcde"[: draw.randint(2, 5)]:
        half = draw.choice((0.01, 0.02, 0.05, 0.1))
        link = {
            "name": name,
            "coefficient": draw.choice((1, -1, 1, 0.5)),
            "nominal_mm": draw.choice((10.0, 25.0, 60.0)),
        }
        fixed = draw.random() < 0.2
        if stated or fixed:
            link |= {"upper_mm": half, "lower_mm": -half * draw.choice((1.0, 0.5)), "fixed": fixed}
        link["distribution"] = draw.choice(("normal", "uniform", "triangular"))
        reach += abs(link["coefficient"]) * half
        links.append(link)
    nominal = sum(link["coefficient"] * link["nominal_mm"] for link in links)
    if draw.random() < 0.3:
        links.append({"name": "f", "coefficient": 1, "expression": "0.01 * (a - b) ** 2 / b"})
        first, second = links[0]["nominal_mm"], links[1]["nominal_mm"]
        nominal += 0.01 * (first - second) ** 2 / second
    width = reach * draw.choice((0.2, 0.4, 0.6, 0.8, 0.95)) * (1.0 if stated else 0.3)
    allocate = {"mode": draw.choice(("worst_case", "rss", "yield")), "target_yield": draw.choice((0.9, 0.9973, 0.999999)),
                "resolution_mm": draw.choice((0.0, 0.001, 0.02)), "method": draw.choice(("equal", "iso286"))}  # fmt: skip
    data = {
        "closing_link": {"lower_mm": nominal - width, "upper_mm": nominal + width * draw.choice((1.0, 0.7))},
        "link": links, "allocate": allocate, "monte_carlo": {"samples": 20_000},
    }  # fmt: skip
    if draw.random() < 0.3:
        data["selective"] = {
            "first": "a",
            "second": "b",
            "classes": 2,
            "by": draw.choice(("width", "probability")),
            "samples": 20_000,
        }
    return Chain.model_validate(data)


def changed(chain: Chain, **tables: object) -> Chain:
    """The chain with keys of its tables replaced, as an edited file has them."""
    data = chain.model_dump(exclude_unset=True)
    for name, keys in tables.items():
        data[name] = keys if isinstance(keys, list) else data.get(name, {}) | keys
    return Chain.model_validate(data)


def followed(chain: Chain, result: ChainResult) -> dict[str, Chain]:
    """The chains that the sentences of a refused one ask for."""
    sentence, chains = result.remedy.sentence, dict[str, Chain]()
    if 'Write mode = "yield"' in sentence:
        chains["yield"] = changed(chain, allocate={"mode": "yield"})
    if pair := CLASSES.search(sentence):
        chains["selective"] = changed(chain, selective={"first": pair[1], "second": pair[2], "classes": int(pair[3])})
    if more := MORE_CLASSES.search(sentence):
        chains["classes"] = changed(chain, selective={"classes": int(more[1])})
    if "the nearest that fits is" in result.status:
        parts = {part.name: part for part in result.allocation}
        keys = "nominal_mm", "upper_mm", "lower_mm"
        links = [
            link | ({key: getattr(parts[link["name"]], key) for key in keys} if link["name"] in parts else {})
            for link in chain.model_dump(exclude_unset=True)["link"]
        ]
        chains["nearest"] = changed(chain, link=links)
    if wide := WIDER.search(result.status):
        low, high = float(wide[1]), float(wide[2])
        chains["limits"] = changed(chain, closing_link={"lower_mm": low - 0.3, "upper_mm": high + 0.3})
    if most := re.search(
        r"target_yield = \S+ \d+ random assemblies cannot show it .* write at most ([\d.]+)", result.status
    ):
        chains["target"] = changed(chain, allocate={"target_yield": float(most[1])})
    return chains


@pytest.mark.slow
def test_fuzz_the_remedies_of_refused_chains_are_accepted():
    """Fuzz: each kind of remedy of random refused chains, followed as its sentence has it."""
    draw, refused, offered, wrong = random.Random(7), 0, Counter[str](), []
    while refused < COUNT:
        chain = random_chain(draw)
        if faults(chain) or not (result := solve(chain)).refused:
            continue
        refused += 1
        for kind, other in followed(chain, result).items():
            offered[kind] += 1
            again = solve(other)
            # A lower target may be out of reach all the same, for a reason that can then be shown.
            if again.refused and not (kind == "target" and "cannot show it" not in again.status):
                wrong.append((refused, kind, result.remedy.sentence, again.status))
    assert not wrong, (offered, wrong)
    assert min(offered[kind] for kind in ("yield", "selective", "classes", "nearest", "limits")) > 2, offered
    print(dict(offered))
