"""Laws of each interaction, and numerics."""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from rbdyn.base.faults import Consistent
from rbdyn.base.fields import SI, NonNegative, NotVanishing, Positive, Share
from rbdyn.properties.materials import MATERIALS, SOFTEST_METAL

METAL_ON_METAL_ALPHA = 0.75  # [s/m]
METAL_BAR_STIFFNESS, POLYMER_BAR_STIFFNESS = 5e7, 2.5e6  # [N/m]
AUTO_WARM_UP_TURNS = 20.0
# Batches of a turn that all replicates together may keep, 0.65 kB each; in one run they are longer where there would be more.
MOST_KEPT, MOST_OF_A_RUN = 4_000_000, 20_000
# Samples a period of the whirl's cutoff: with fewer the velocity errs and what is faster folds down.
SAMPLES_A_PERIOD = 10
# Samples of filtered whirl that all replicates together may take, before they are lengthened.
MOST_SAMPLES = 1e7


def with_bar_stiffness_of_cage(scene: Mapping[str, Any]) -> Mapping[str, Any]:
    """Tables of a scene, with the stiffness of a cross-bar of polymer where the cage is of it and [model] leaves it out."""
    materials, laws = scene.get("materials"), scene.get("model", {})
    if not isinstance(materials, Mapping) or not isinstance(laws, Mapping):
        return scene
    cage = materials.get("cage")
    named = MATERIALS[cage].elastic_modulus * 1e-9 if isinstance(cage, str) and cage in MATERIALS else None
    modulus = cage.get("elastic_modulus_GPa") if isinstance(cage, Mapping) else named
    if not isinstance(modulus, int | float) or modulus * 1e9 >= SOFTEST_METAL:
        return scene
    return {**scene, "model": {"pocket_bar_stiffness_N_m": POLYMER_BAR_STIFFNESS, **laws}}


class Laws(Consistent):
    """The laws of each interaction and what they need. What is off is neither computed nor compiled."""

    line_contact: Literal["palmgren", "iso16281", "dowson_higginson", "houpert"] = "palmgren"
    """Load of a roller against its approach. Palmgren's is the law of Chen et al. 2022; the rivals lie within 7 %."""
    slices: Annotated[int, Field(ge=1, le=1001)] | None = None
    """Slices of a roller; where left out 1, which is exact where there is neither profile nor tilt, and 31 where there
    is one."""
    race_damping: Literal["viscous", "hunt_crossley", "off"] = "viscous"
    """Damping of the races: a share of the critical one, Hunt and Crossley's, or none."""
    race_damping_ratio: Share = 0.05
    """Share of critical damping, engaged over race_damping_engagement_um (ADORE-style input 0.05; 0.1 elsewhere)."""
    race_damping_engagement_um: Positive = 0.1
    """Approach over which viscous damping sets in: about half a film thickness."""
    race_damping_alpha_s_m: Positive = 0.2
    """Hunt and Crossley's alpha of the races, for race_damping = "hunt_crossley": 0.08 to 0.32 s/m for metals."""
    pocket: Literal["contact", "off"] = "contact"
    """Contact of rollers and pocket walls; "off" lets rollers and cage pass through each other."""
    pocket_bar_stiffness_N_m: Positive | Literal["rigid"] = METAL_BAR_STIFFNESS  # noqa: N815
    """Stiffness of a cross-bar, in series with the contact. Where left out it follows from the section of the cage
    (cage.bar_width_mm and its three fellows); without a section it is 5e7 N/m, and 2.5e6 N/m where the cage is of polymer
    (elastic modulus below 20 GPa), which has a twentieth of the modulus of metals. That of metals rests on the 1e7 to 1e8
    N/m stated for metal cages. By the section a bar clamped at its ends has 192 E I/L^3 under a roller that touches its
    middle (I = thickness width^3/12), 720 all along it, and shear in series; the side rings give way too and leave a
    quarter to a half of it. With 1e7, 5e7 and 2e8 N/m the bearing of Chen et al. 2022 has impacts of 47, 86 and 118 N and a
    whirl of 0.42, 0.41 and 0.38."""
    pocket_damping_alpha_s_m: NonNegative | None = None
    """Hunt and Crossley's alpha of the pocket walls; 0.75 where left out (restitution 1 - alpha v: 0.5 to 0.7 for steel
    on wetted bronze at 0.5 m/s), 0 is undamped."""
    pocket_restitution: Share | None = None
    """Restitution of roller and pocket wall at pocket_restitution_speed_m_s, instead of pocket_damping_alpha_s_m."""
    pocket_restitution_speed_m_s: Positive = 0.5
    """Impact speed at which pocket_restitution holds."""
    pocket_friction: NonNegative = 0.05
    """Friction coefficient of roller and pocket wall."""
    pocket_film: bool = False
    """Oil film on both pocket walls, which wedge and squeeze make together, with its shear; it hands over to contact at
    its floor."""
    pocket_film_floor_um: Positive = 0.8
    """Film thickness at which the pocket wall touches: the critical pocket film of ADORE-style inputs is 0.8 um."""
    pocket_fill: Share = 1.0
    """Share of a pocket wall that has oil; 1 is flooded."""
    guide_land: Literal["film", "dry", "off"] = "film"
    """Force of the guide land on the cage: short journal bearing over dry contact, dry contact alone, or none."""
    land_film_floor_um: Positive = 3.0
    """Film thickness below which the land touches: the critical film of ADORE-style inputs."""
    land_fill: Share = 1.0
    """Share of the land that is full of oil; 1 is flooded."""
    land_damping_alpha_s_m: NonNegative | None = None
    """Hunt and Crossley's alpha of the land's dry contact; 0.75 where left out, 0 is undamped."""
    land_restitution: Share | None = None
    """Restitution of cage and land at land_restitution_speed_m_s, instead of land_damping_alpha_s_m."""
    land_restitution_speed_m_s: Positive = 0.5
    """Impact speed at which land_restitution holds."""
    land_friction: NonNegative = 0.05
    """Friction coefficient of the land's dry contact."""
    rolling_resistance: Literal["biboulet_houpert", "off"] = "biboulet_houpert"
    """Rolling resistance of the races by the hydrodynamic inlet (Biboulet and Houpert 2010), or none."""
    rolling_resistance_factor: Annotated[float, Field(gt=0.0, le=5.0), NotVanishing] = 1.0
    """What multiplies the rolling resistance, in force and in power. Isothermal elastohydrodynamic solutions of one
    contact put 1 at 0.97 to 1.15 (2 F u is lost a contact: F is a force per surface); SKF's rolling moments of ten
    catalogue bearings want 0.5 to 1.3, the less the faster, the lighter loaded and the thicker the oil
    (examples/published/friction_totals.py)."""
    open_contact_film: bool = False
    """Oil film between race and rollers that do not touch it, with rolling resistance and shear of a rigid pair at the gap
    (Reynolds' equation). It draws on the inlet of lubricant.inlet_distance and drives rollers and cage where no load does."""
    drag: Literal["cylinder", "off"] = "cylinder"
    """Drag of the rollers in the mixture of oil and air, as cylinders across a flow, or none."""
    drag_coefficient: NonNegative = 1.0
    """What multiplies the drag: 1 is a free cylinder; packed rollers shield each other (0.3 to 0.5)."""

    pocket_film_floor, land_film_floor = SI("um"), SI("um")

    @property
    def race_damping_rate(self) -> float:
        """Part of the damping engaged per approach [1/m]."""
        return 1e6 / self.race_damping_engagement_um

    def faults(self) -> Iterator[str]:
        for part in ("pocket", "land"):
            keys = f"{part}_restitution", f"{part}_damping_alpha_s_m"
            if all(getattr(self, key) is not None for key in keys):
                yield f"model.{keys[0]} and model.{keys[1]} contradict each other: give one of them"
        if self.pocket == "off" and self.pocket_film:
            what = "model.pocket = 'off' and model.pocket_film = true contradict each other"
            yield f"{what}: drop the film or the 'off'"
        if self.rolling_resistance == "off" and self.open_contact_film:
            what = "model.rolling_resistance = 'off' and model.open_contact_film = true contradict each other"
            yield f"{what}: drop the film or the 'off'"

    def alpha(self, part: str) -> float:
        """Hunt and Crossley's alpha [s/m] of 'pocket' or 'land', given or from its restitution."""
        restitution = getattr(self, f"{part}_restitution")
        if restitution is not None:
            from rbdyn.contact.damping import alpha_of_restitution

            return alpha_of_restitution(restitution, getattr(self, f"{part}_restitution_speed_m_s"))
        given = getattr(self, f"{part}_damping_alpha_s_m")
        return METAL_ON_METAL_ALPHA if given is None else float(given)


class Numerics(Consistent):
    """Tolerance, length and replication of a run."""

    method: Literal["auto", "rk45", "rk43", "rosenbrock"] = "auto"
    """Integrator. rk45: explicit Dormand-Prince; rk43: explicit, by Kutta's 3/8 rule; rosenbrock: linearly implicit
    RODAS4, for scenes whose explicit steps are held by stability. auto: rk43 from rtol 5e-3 on, below it rk45, unless a
    trial at the start of a run shows the implicit one to be cheaper."""
    rtol: Annotated[float, Field(ge=1e-13, le=0.1)] = 1e-2
    """Tolerance of a step, of the approach and speed of a race contact at its mean load share. At 1e-2 impact, whirl
    and loss of the bearing of Chen et al. 2022 are off by -0.05 +- 0.12, +0.1 +- 0.4 and 0.000 +- 0.008 %, at 1e-1 by
    -0.6, -4.0 and +0.025 % (against rk45 at 1e-4)."""
    turns: Annotated[float, Field(gt=0.0, le=1e6)] = 100
    """Shaft turns that are counted, after discard_turns."""
    discard_turns: Annotated[float, Field(ge=0.0, le=1e6)] | Literal["auto"] = 20.0
    """Shaft turns before the counted ones, left out as transient; "auto" takes what the series of the run show, at
    least a batch."""
    extend: bool = True
    """Count three relaxation times of the slowest motion at least; where the figures of the counted turns drift, run twice as
    long and count the last half. Counted turns are filled up to whole impact windows."""
    extend_limit: Annotated[float, Field(ge=1.0, le=1000.0)] = 8.0
    """Longest run that extend makes, as a multiple of the turns asked for."""
    replicates: Annotated[int, Field(ge=1, le=10000)] = 8
    """Runs of the same scene from different starts; they show the statistical error."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of all random starts and spreads: equal scenes of equal seed and version give equal bits."""
    impact_window_turns: Annotated[float, Field(gt=0.0), NotVanishing] = 20
    """Window over which the largest force is taken, for it grows with the time one waits; several windows are averaged.
    """
    samples_per_turn: Annotated[int, Field(ge=8, le=100000)] = 512
    """Samples of the motion a shaft turn, for whirl and histories."""
    whirl_cutoff_hz: Positive | None = None
    """Low pass for the whirl deviation ratio, as a rig's signal has one: the cage's centre is sampled ten times a period
    of it and filtered, forward and backward. None: the velocities as integrated, as they have no noise."""
    whirl_notches_hz: list[Positive] = []
    """Frequencies taken out of the filtered whirl, as a rig's runout at cage and shaft rotation is; each where a run has
    ten periods of it."""
    companion: bool = True
    """Repeat a share of the replicates at ten times the tolerance to estimate the numerical error. Where stability holds the
    steps of a slow bearing, they are repeated with steps that resolve its light contacts instead."""
    companion_share: Share = 0.25
    """Share of the replicates that companion repeats."""
    step_budget_per_turn: Annotated[int, Field(ge=100)] = 100_000
    """Steps a shaft turn after which a run gives up, with where and why. The default stands for about 1 s a turn of
    10 rollers in one slice (8 us a step on one core) and 14 s of 80 rollers in 31 slices (0.14 ms a step)."""

    @property
    def warm_up_turns(self) -> float:
        """Turns run before the counted ones; with "auto" some of them may count after all, or more be dropped."""
        return AUTO_WARM_UP_TURNS if self.discard_turns == "auto" else float(self.discard_turns)

    @property
    def companions(self) -> int:
        """How many replicates are repeated."""
        return math.ceil(self.companion_share * self.replicates - 1e-9) if self.companion else 0

    @property
    def most_batches(self) -> int:
        """Batches for which each replicate and companion has memory."""
        return MOST_KEPT // (self.replicates + self.companions)

    def faults(self) -> Iterator[str]:
        if self.whirl_notches_hz and self.whirl_cutoff_hz is None:
            yield "numerics.whirl_notches_hz: without numerics.whirl_cutoff_hz nothing is filtered; give that too"
        if min(self.turns, MOST_OF_A_RUN) + min(self.warm_up_turns, MOST_OF_A_RUN) > self.most_batches:
            yield (
                f"turns = {self.turns:g}: {self.replicates + self.companions} replicates and companions have memory "
                f"for {self.most_batches} turns each, warm-up included; take fewer turns or replicates"
            )
