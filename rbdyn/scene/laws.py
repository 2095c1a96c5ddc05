"""Laws of each interaction, and numerics."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from rbdyn.faults import Strict
from rbdyn.fields import SI, NonNegative, NotVanishing, Positive, or_refuse

METAL_ON_METAL_ALPHA = 0.75  # [s/m]
AUTO_WARM_UP_TURNS = 20.0
# Batches of a turn that all replicates together may keep, 0.65 kB each; in one run they are longer where there would be more.
MOST_KEPT, MOST_OF_A_RUN = 4_000_000, 20_000
Restitution = Annotated[float, Field(gt=0.0, le=1.0), NotVanishing]


class Laws(Strict):
    """The laws of each interaction and what they need. What is off is neither computed nor compiled."""

    # Load against approach: Palmgren is the one of Chen et al. 2022; the rivals lie within 7 %.
    line_contact: Literal["palmgren", "iso16281", "dowson_higginson", "houpert"] = "palmgren"
    # Slices of a roller; one is exact where there is neither profile nor tilt, 31 are taken where there is.
    slices: Annotated[int, Field(ge=1, le=1001)] | None = None
    race_damping: Literal["viscous", "hunt_crossley", "off"] = "viscous"
    # Share of critical damping (ADORE-style input 0.05; 0.1 elsewhere), engaged over about half a film thickness.
    race_damping_ratio: Annotated[float, Field(gt=0.0, le=1.0), NotVanishing] = 0.05
    race_damping_engagement_um: Positive = 0.1
    # 0.08 to 0.32 s/m for metals.
    race_damping_alpha_s_m: Positive = 0.2
    pocket: Literal["contact", "off"] = "contact"
    # Cross-bar in series with the contact. Rests on the 1e7 to 1e8 N/m told of metal cages, which count the cage's rims
    # and ring in. A drawing gives, for a clamped bar of length L pushed in its middle, 192 E I/L^3 (384 for an even push;
    # I = thickness width^3/12) and, in series, 10/3 G A/L of shear, which rules in short bars: 5e8 N/m in the bearing of
    # Chen et al. 2022. With 1e7, 5e7 and 2e8 N/m that has impacts of 47, 86 and 118 N and a whirl of 0.42, 0.41 and 0.38.
    pocket_bar_stiffness_N_m: Positive | Literal["rigid"] = 5e7  # noqa: N815
    # Hunt and Crossley's alpha, 0.75 unless given (restitution 1 - alpha v: 0.5 to 0.7 for steel on wetted bronze at
    # 0.5 m/s; 0 is undamped).
    pocket_damping_alpha_s_m: NonNegative | None = None
    # Or by a restitution at an impact speed, instead of alpha.
    pocket_restitution: Restitution | None = None
    pocket_restitution_speed_m_s: Positive = 0.5
    pocket_friction: NonNegative = 0.05
    # Film on both walls that wedge and squeeze make together, with its shear; it hands over to contact at the floor (the
    # critical pocket film of ADORE-style inputs is 0.8 um). The fill is the share of the wall that has oil.
    pocket_film: bool = False
    pocket_film_floor_um: Positive = 0.8
    pocket_fill: Annotated[float, Field(gt=0.0, le=1.0), NotVanishing] = 1.0
    guide_land: Literal["film", "dry", "off"] = "film"
    # Film below which the land touches (critical film of ADORE-style inputs), and how full of oil the land is.
    land_film_floor_um: Positive = 3.0
    land_fill: Annotated[float, Field(gt=0.0, le=1.0), NotVanishing] = 1.0
    land_damping_alpha_s_m: NonNegative | None = None
    land_restitution: Restitution | None = None
    land_restitution_speed_m_s: Positive = 0.5
    land_friction: NonNegative = 0.05
    rolling_resistance: Literal["biboulet_houpert", "off"] = "biboulet_houpert"
    # What multiplies it, in force and in power. Isothermal elastohydrodynamic solutions of one contact put 1 at 0.97 to
    # 1.15 (2 F u is lost a contact: F is a force per surface); SKF's rolling moments of ten catalogue bearings want 0.5 to
    # 1.3, the less the faster, the lighter loaded and the thicker the oil (examples/published/friction_totals.py).
    rolling_resistance_factor: Annotated[float, Field(gt=0.0, le=5.0), NotVanishing] = 1.0
    drag: Literal["cylinder", "off"] = "cylinder"
    # A free cylinder; packed rollers shield each other (0.3 to 0.5).
    drag_coefficient: NonNegative = 1.0

    pocket_film_floor, land_film_floor = SI("um"), SI("um")

    @property
    def race_damping_rate(self) -> float:
        """Part of the damping engaged per approach [1/m]."""
        return 1e6 / self.race_damping_engagement_um

    @model_validator(mode="after")
    def _agrees(self) -> Laws:
        faults = [
            f"model.{part}_restitution and model.{part}_damping_alpha_s_m contradict each other: give one of them"
            for part in ("pocket", "land")
            if getattr(self, f"{part}_restitution") is not None
            and getattr(self, f"{part}_damping_alpha_s_m") is not None
        ]
        if self.pocket == "off" and self.pocket_film:
            faults.append(
                "model.pocket = 'off' and model.pocket_film = true contradict each other: drop the film or the 'off'"
            )
        return or_refuse(self, faults)

    def alpha(self, part: str) -> float:
        """Hunt and Crossley's alpha [s/m] of 'pocket' or 'land', given or from its restitution."""
        restitution = getattr(self, f"{part}_restitution")
        if restitution is not None:
            from rbdyn.contact.damping import alpha_of_restitution

            return alpha_of_restitution(restitution, getattr(self, f"{part}_restitution_speed_m_s"))
        given = getattr(self, f"{part}_damping_alpha_s_m")
        return METAL_ON_METAL_ALPHA if given is None else float(given)


class Numerics(Strict):
    """Tolerance, length and replication of a run."""

    # rk45: explicit Dormand-Prince. rk43: explicit, by Kutta's 3/8 rule. rosenbrock: linearly implicit RODAS4, for scenes
    # whose explicit steps are held by stability. auto: rk43 from rtol 5e-3 on, below it rk45, unless a trial at the start
    # of a run shows the implicit one to be cheaper.
    method: Literal["auto", "rk45", "rk43", "rosenbrock"] = "auto"
    # Per step, of the approach and speed of a race contact at its mean load share. At 1e-2 impact, whirl and loss of the
    # bearing of Chen et al. 2022 are off by -0.05 +- 0.12, +0.1 +- 0.4 and 0.000 +- 0.008 %, at 1e-1 by -0.6, -4.0 and
    # +0.025 % (against rk45 at 1e-4).
    rtol: Annotated[float, Field(ge=1e-13, le=0.1)] = 1e-2
    turns: Annotated[float, Field(gt=0.0, le=1e6)] = 100
    # "auto": what the series of the run show to be its transient, at least a batch; else so many turns.
    discard_turns: Annotated[float, Field(ge=0.0, le=1e6)] | Literal["auto"] = 20.0
    # Where the figures of the counted turns drift, run on and count the last half, at most so many times the turns asked
    # for in all (rbdyn.dynamics.settling); counted turns are filled up to whole impact windows.
    extend: bool = True
    extend_limit: Annotated[float, Field(ge=1.0, le=1000.0)] = 8.0
    replicates: Annotated[int, Field(ge=1, le=10000)] = 8
    seed: Annotated[int, Field(ge=0)] = 1
    # The largest force grows with the time one waits for it, so it is taken over windows of a fixed length.
    impact_window_turns: Annotated[float, Field(gt=0.0), NotVanishing] = 20
    samples_per_turn: Annotated[int, Field(ge=8, le=100000)] = 512
    # Repeats a share of the replicates at another tolerance to find the numerical error.
    companion: bool = True
    companion_share: Annotated[float, Field(gt=0.0, le=1.0), NotVanishing] = 0.25
    step_budget_per_turn: Annotated[int, Field(ge=100)] = 100_000

    @property
    def warm_up_turns(self) -> float:
        """Turns run before the counted ones; with "auto" some of them may count after all, or more be dropped."""
        return AUTO_WARM_UP_TURNS if self.discard_turns == "auto" else float(self.discard_turns)

    @property
    def companions(self) -> int:
        """How many replicates are repeated."""
        return math.ceil(self.companion_share * self.replicates - 1e-9) if self.companion else 0

    @model_validator(mode="after")
    def _fits_into_memory(self) -> Numerics:
        runs = self.replicates + self.companions
        most = MOST_KEPT // runs
        if min(self.turns, MOST_OF_A_RUN) + min(self.warm_up_turns, MOST_OF_A_RUN) > most:
            raise ValueError(
                f"turns = {self.turns:g}: {runs} replicates and companions have memory for {most} turns each, warm-up "
                "included; take fewer turns or replicates"
            )
        return self
