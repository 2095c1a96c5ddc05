"""A dimension chain on the terminal."""

from collections.abc import Mapping
from typing import Any

from doe.dimension_chain import ChainResult
from doe.dimension_chain.selective_assembly import SelectiveAssembly
from rbdyn.cli.terminal import print_table
from rbdyn.records.words import counted, with_error

BAR = 20  # characters of a contribution of 100 %
NORMAL = 1.96  # half-width of a 95 % interval over its standard error


def chains_record(results: Mapping[str, ChainResult]) -> dict[str, Any]:
    """JSON of ``doe chain`` for a file of several chains."""
    refused = [name for name, result in results.items() if result.refused]
    status = f"refused: {', '.join(refused)}" if refused else "ok"
    return {"chains": {name: result.as_dict() for name, result in results.items()}, "status": status}


def print_chain(name: str, chain: ChainResult, quiet: bool = False, verbose: bool = False) -> None:
    """Parts, contributions, closing link and yield of a dimension chain; verbosely also the yields by distribution."""
    told = {"ok": ": parts that would fill the limits, which the given ones keep"}.get(chain.status, "")
    title = f"dimension chain {name}" + (": the nearest parts that meet the limits" if chain.refused else told)
    moved = [f"{part.moved_mm:+.4f}" if part.moved_mm else "" for part in chain.allocation]
    rows = [(part.name, part.text, part.grade or "", *([by] if any(moved) else []))
            for part, by in zip(chain.allocation, moved, strict=True)]  # fmt: skip
    print_table(title, ("part", "dimension [mm]", "grade", *(["nominal moved [mm]"] if any(moved) else [])), rows)
    if quiet:
        return
    shares = [
        (part, _percent(each["variance_percent"]), _percent(each["worst_case_percent"]))
        for part, each in chain.contributions.items()
    ]
    print_table("contributions", ("part", "variance", "worst case"), shares)
    if verbose:
        _print_yields(chain)
        quantiles = [(f"{100 * share:g} %", f"{size:.4f}") for share, size in chain.quantiles_mm.items()]
        print_table("quantiles of the closing link", ("share below", "size [mm]"), quantiles)
    _print_answer(chain)
    if not chain.refused:
        print(chain.status)
    if chain.selective is not None:
        _print_selective(chain.selective, verbose)


def _percent(percent: float) -> str:
    return f"{'█' * round(BAR * percent / 100)} {percent:5.1f} %"


def _print_yields(chain: ChainResult) -> None:
    exact = chain.exact_yields or {}
    rows = [
        (
            kind.replace("_", " "),
            with_error(share, NORMAL * chain.standard_errors[kind]),
            f"{exact[kind]:.6f}" if kind in exact else "",
            *(_ppm(chain.rejected[kind], side) for side in ("low", "high")),
        )
        for kind, share in chain.yields.items()
    ]
    header = ("distribution of the parts", "yield", "without sampling", "ppm below", "ppm above")
    print_table(f"yield by {counted(chain.samples, 'sample')} (95 % intervals)", header, rows)


def _ppm(rejected: Mapping[str, float], side: str) -> str:
    return with_error(rejected[f"{side}_ppm"], NORMAL * rejected[f"{side}_standard_error_ppm"])


def _print_answer(chain: ChainResult) -> None:
    (low, high), (least, most), out = chain.worst_case_mm, chain.rss_mm, chain.rejected["as_given"]
    closing = f"closing link {low:.4f} to {high:.4f} mm in worst case, {least:.4f} to {most:.4f} mm by root sum square"
    good = with_error(chain.yields["as_given"], NORMAL * chain.standard_errors["as_given"])
    able = f", Cp {chain.cp:.2f}, Cpk {chain.cpk:.2f}" if chain.cp is not None else ""
    ppm = (
        f"({out['low_ppm']:.0f} ppm below, {out['high_ppm']:.0f} ppm above){able}; the laws of the parts count as exact"
    )
    print(f"{'as given: ' if chain.refused else ''}{closing}, yield {good} {ppm}")
    if chain.linearisation is not None:
        bent = chain.linearisation
        worst = f"the worst case by {bent.worst_case_error_mm:.4f} mm, the mean by {bent.mean_shift_mm:+z.4f} mm"
        spread = f"the standard deviation by {bent.deviation_error_percent or 0.0:+z.1f} %"
        print(f"a linear chain would miss {worst} and {spread}")
    if chain.cost is not None:
        print(f"cost of the allocated tolerances {chain.cost:.4g}")


def _print_selective(found: SelectiveAssembly, verbose: bool) -> None:
    low, high = found.worst_case_mm
    needed = "no number of classes keeps" if found.classes_needed is None else f"{found.classes_needed} would keep"
    closing = f"closing link {low:.4f} to {high:.4f} mm in worst case ({needed} the limits)"
    mates = (
        f"{100 * found.matched:.2f} % of the parts find a mate, {with_error(found.good, NORMAL * found.standard_error)}"
    )
    good = f"of the matched within the limits ({found.random:.6f} at random)"
    print(f"matched in {counted(found.classes, 'class')}: {closing}, {mates} {good}")
    if verbose:
        rows = [(name, "  ".join(f"{edge:.4f}" for edge in edges)) for name, edges in found.edges_mm.items()]
        print_table("classes", ("part", "limits of the classes [mm]"), rows)
