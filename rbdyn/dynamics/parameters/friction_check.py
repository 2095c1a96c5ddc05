"""The maker's friction next to the simulated power loss, for scenes that state a designation."""

from typing import Any

from rbdyn.life.maker_friction import iso_15312_heat, skf_moments
from rbdyn.scene import Scene
from rbdyn.scene.notes import catalogued

# A ratio of simulated to maker's loss outside this is noted: SKF's model is a factor of two off ISO 15312 itself.
USUAL_RATIO = (0.5, 2.0)


def friction_check(scene: Scene, power_loss: float) -> dict[str, float | None] | None:
    """SKF's moments [N mm] and power, the heat of ISO 15312, and the simulated ``power_loss`` [W] over SKF's power.

    At the speed, load and oil of the scene; the load is the steady one with what rotates in line with it. None without a
    designation, or where a schedule varies them; the ratio is None where SKF's power is nil: no load, or no speed.
    """
    listed = catalogued(scene.bearing)
    if listed is None or scene.operation.schedule is not None:
        return None
    named, sizes = listed
    inner, outer = scene.operation.speeds
    oil, load = scene.lubricant.in_service, scene.operation.largest_load_N
    lengths = 1e-3 * sizes.bore, 1e-3 * sizes.outside
    viscosity, supply = oil.viscosity / oil.density, scene.lubricant.supply
    moments = skf_moments(named.series, *lengths, inner - outer, viscosity, load, supply=supply)
    power = sum(moments) * abs(inner - outer)
    return {
        "skf_power_W": power,
        "skf_rolling_moment_N_mm": 1e3 * moments.rolling,
        "skf_sliding_moment_N_mm": 1e3 * moments.sliding,
        "iso_15312_heat_W": iso_15312_heat(sizes),
        "ratio": power_loss / power if power > 0.0 else None,
    }


def friction_notes(check: dict[str, Any] | None) -> tuple[str, ...]:
    """A note where the simulated power loss is far from SKF's."""
    ratio = None if check is None else check["ratio"]
    low, high = USUAL_RATIO
    if check is None or ratio is None or low <= ratio <= high:
        return ()
    what = f"power loss: {ratio:.2g} times the {check['skf_power_W']:.3g} W of SKF's friction model, outside {low:g} to {high:g}"
    return (f"{what}; compare the power terms, the oil and lubricant.supply",)
