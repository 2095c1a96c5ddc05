"""A dimension chain on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbdyn.terminal import print_table

if TYPE_CHECKING:
    from doe.dimension_chain import ChainResult, Part


def print_chain(name: str, chain: ChainResult, quiet: bool = False, verbose: bool = False) -> None:
    """Parts, closing link and yield of a dimension chain; verbosely, all yields and contributions."""
    refused = chain.status.startswith("refused")
    title = f"dimension chain {name}" + (": the nearest parts that meet the limits" if refused else "")
    rows = [(part.name, part_text(part), part.grade or "") for part in chain.allocation]
    print_table(title, ("part", "dimension [mm]", "grade"), rows)
    if verbose:
        shares = [
            (part, f"{each['variance_percent']:.1f} %", f"{each['worst_case_percent']:.1f} %")
            for part, each in chain.contributions.items()
        ]
        print_table("contributions", ("part", "variance", "worst case"), shares)
        yields = [(kind.replace("_", " "), f"{share:.6f}") for kind, share in chain.yields.items()]
        print_table(f"yield, ± {chain.standard_error:.1g}", ("distribution of the parts", "yield"), yields)
    if quiet:
        return
    low, high = chain.worst_case_mm
    print(
        f"{'as given: ' if refused else ''}closing link {low:.4f} to {high:.4f} mm in worst case, yield "
        f"{chain.yields['as_given']:.6f} ± {chain.standard_error:.1g}"
    )


def part_text(part: Part) -> str:
    """'9.2900 0/-0.0050'."""

    def deviation(value: float) -> str:
        return "0" if value == 0.0 else f"{value:+.4f}"

    return f"{part.nominal_mm:.4f} {deviation(part.upper_mm)}/{deviation(part.lower_mm)}"
