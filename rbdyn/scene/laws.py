"""Laws of each interaction, and numerics."""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from rbdyn.base.faults import SI, Consistent, NonNegative, NotVanishing, Positive, Share, Sparse
from rbdyn.properties.materials import MATERIALS, SOFTEST_METAL
from rbdyn.verdict.orbits import Thresholds

METAL_ON_METAL_ALPHA = 0.75  # [s/m]
METAL_BAR_STIFFNESS, POLYMER_BAR_STIFFNESS = 5e7, 2.5e6  # [N/m]
AUTO_WARM_UP_TURNS = 20.0
# Most batches of a turn in memory (0.65 kB each): over all replicates, and in one run, which then has longer batches.
MOST_KEPT, MOST_OF_A_RUN = 4_000_000, 20_000
# Slower, a cage has no speed that slip or orbit could be measured in [rad/s].
SLOWEST_CAGE = 1e-6
# Samples in a period of the whirl's cutoff: fewer make the velocity inaccurate and alias faster motion.
SAMPLES_A_PERIOD = 10
# Most samples of filtered whirl over all replicates, before any extension.
MOST_SAMPLES = 1e7


def with_bar_stiffness_of_cage(scene: Mapping[str, Any]) -> Mapping[str, Any]:
    """Tables of a scene, with the stiffness of a polymer cross-bar where the cage is of polymer and [model] states none."""
    materials, laws = scene.get("materials"), scene.get("model", {})
    if not isinstance(materials, Mapping) or not isinstance(laws, Mapping):
        return scene
    cage = materials.get("cage")
    by_name = MATERIALS[cage].elastic_modulus * 1e-9 if isinstance(cage, str) and cage in MATERIALS else None
    modulus = cage.get("elastic_modulus_GPa") if isinstance(cage, Mapping) else by_name
    if not isinstance(modulus, int | float) or modulus * 1e9 >= SOFTEST_METAL:
        return scene
    return {**scene, "model": {"pocket_bar_stiffness_N_m": POLYMER_BAR_STIFFNESS, **laws}}


class Laws(Consistent):
    """The laws of each interaction and their parameters. A law that is off is neither computed nor compiled."""

    line_contact: Literal["palmgren", "iso16281", "dowson_higginson", "houpert"] = "palmgren"
    """Law of roller load against approach. Chen et al. 2022 use Palmgren's; the others agree within 7 %."""
    slices: Annotated[int, Field(ge=1, le=1001)] | None = None
    """Number of slices of a roller. Default: 1 without profile and tilt, which is exact, otherwise 31."""
    race_damping: Literal["viscous", "hunt_crossley", "off"] = "viscous"
    """Damping of the raceway contacts: a share of critical damping, Hunt and Crossley's law, or none."""
    race_damping_ratio: Share = 0.05
    """Damping ratio, reached over race_damping_engagement_um. ADORE-style inputs have 0.05, other sources 0.1."""
    race_damping_engagement_um: Positive = 0.1
    """Approach over which viscous damping rises to its full value: about half a film thickness."""
    race_damping_alpha_s_m: Positive = 0.2
    """Hunt and Crossley's alpha of the raceways, for race_damping = "hunt_crossley". Typical: 0.08 to 0.32 s/m for metals."""
    pocket: Literal["contact", "off"] = "contact"
    """Contact between rollers and pocket walls; "off" lets rollers and cage pass through each other."""
    pocket_bar_stiffness_N_m: Positive | Literal["rigid"] = METAL_BAR_STIFFNESS  # noqa: N815
    """Stiffness of one cage bar, in series with the roller contact. Default: calculated from the cage section
    (cage.bar_width_mm, bar_thickness_mm, bar_length_mm, side_ring_width_mm). Without a section: 5e7 N/m for metals (published:
    1e7 to 1e8), 2.5e6 N/m for polymers (modulus below 20 GPa), in proportion to the modulus. Estimate: a clamped bar has 192 E
    I/L^3 for a central load and 720 E I/L^3 for a uniform load, with I = thickness width^3/12; add the shear compliance in
    series. Flexible side rings leave a quarter to a half of this. Effect: 1e7, 5e7 and 2e8 N/m give impact forces of 47, 87
    and 119 N and whirl ratios of 0.41, 0.41 and 0.39 in the bearing of Chen et al. 2022."""
    pocket_damping_alpha_s_m: NonNegative | None = None
    """Hunt and Crossley's alpha of the pocket walls; 0 is undamped. Default: 0.75 s/m. The restitution is 1 - alpha v, 0.5 to
    0.7 for steel on wet bronze at 0.5 m/s."""
    pocket_restitution: Share | None = None
    """Coefficient of restitution of roller and pocket wall at pocket_restitution_speed_m_s, instead of
    pocket_damping_alpha_s_m."""
    pocket_restitution_speed_m_s: Positive = 0.5
    """Impact speed at which pocket_restitution holds."""
    pocket_friction: NonNegative = 0.05
    """Friction coefficient of roller and pocket wall."""
    pocket_film: bool = False
    """Oil film on both pocket walls by wedge and squeeze action, with its shear. Below pocket_film_floor_um the wall is in
    contact."""
    pocket_film_floor_um: Positive = 0.8
    """Film thickness at which the pocket wall comes into contact: the critical pocket film of ADORE-style inputs."""
    pocket_fill: Share = 1.0
    """Share of a pocket wall that is covered with oil; 1 is flooded."""
    guide_land: Literal["film", "dry", "off"] = "film"
    """Force of the guide land on the cage: oil film and dry contact, dry contact alone, or none. The film is a short journal
    bearing."""
    land_film_floor_um: Positive = 3.0
    """Film thickness below which the land is in contact: the critical film of ADORE-style inputs."""
    land_fill: Share = 1.0
    """Share of the land filled with oil; 1 is flooded."""
    land_damping_alpha_s_m: NonNegative | None = None
    """Hunt and Crossley's alpha of the land's dry contact; 0 is undamped. Default: 0.75 s/m."""
    land_restitution: Share | None = None
    """Coefficient of restitution of cage and land at land_restitution_speed_m_s, instead of land_damping_alpha_s_m."""
    land_restitution_speed_m_s: Positive = 0.5
    """Impact speed at which land_restitution holds."""
    land_friction: NonNegative = 0.05
    """Friction coefficient of the land's dry contact."""
    rolling_resistance: Literal["biboulet_houpert", "off"] = "biboulet_houpert"
    """Rolling resistance of the raceways by the hydrodynamic inlet (Biboulet and Houpert 2010), or none."""
    rolling_resistance_factor: Annotated[float, Field(gt=0.0, le=5.0), NotVanishing] = 1.0
    """Factor on the rolling resistance, in force and in power. Isothermal elastohydrodynamic solutions of one contact correspond
    to 0.97 to 1.15, with a loss of 2 F u in each contact (F is the force on one surface). SKF's rolling moments of ten catalogue
    bearings correspond to 0.5 to 1.3 (examples/published/friction_totals.py). That factor decreases with speed and viscosity
    and increases with load."""
    open_contact_film: bool = False
    """Oil film between a raceway and the rollers that do not touch it. Effect: rolling resistance and shear of rigid surfaces
    at the gap (Reynolds' equation). Without lubricant.inlet_distance it is flooded, and drives rollers and cage without any
    load. With it, one oil layer feeds loaded and open contacts. The layer fills the gap where the oil of the mean loaded inner
    contact begins: 4 to 26 um under 300 to 2000 N per contact. A wider gap has no film."""
    drag: Literal["cylinder", "off"] = "cylinder"
    """Drag of the rollers in the mixture of oil and air, as of cylinders in cross-flow, or none."""
    drag_coefficient: NonNegative = 1.0
    """Drag coefficient: 1 for a free cylinder, 0.3 to 0.5 for rollers in a row, which shield each other."""

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
            yield "model.pocket = 'off' and model.pocket_film = true contradict each other: leave out one of them"
        if self.rolling_resistance == "off" and self.open_contact_film:
            yield (
                "model.rolling_resistance = 'off' and model.open_contact_film = true contradict each other: leave out one of them"
            )

    def alpha(self, part: str) -> float:
        """Hunt and Crossley's alpha [s/m] of 'pocket' or 'land', given or from its restitution."""
        restitution = getattr(self, f"{part}_restitution")
        if restitution is not None:
            from rbdyn.contact.damping import alpha_of_restitution

            return alpha_of_restitution(restitution, getattr(self, f"{part}_restitution_speed_m_s"))
        alpha = getattr(self, f"{part}_damping_alpha_s_m")
        return METAL_ON_METAL_ALPHA if alpha is None else float(alpha)


class Damage(Sparse):
    """Inputs of figures of damage; no motion depends on them."""

    UNSAVED: ClassVar[Mapping[str, Any]] = {
        "impacts": True,
        "races": True,
        "impact_speed_m_s": 0.01,
        "fatigue_exponent": 8.0,
        "stress_concentration": 2.0,
    }

    impacts: bool = True
    """Whether impacts in the pockets are followed one by one, for impacts_per_turn, impact_energy_J and
    impact_fatigue_force_N. A study follows them only where it names one of these."""
    races: bool = True
    """Whether the raceway contacts are sampled 24 times per shaft turn, for power density, flash temperature and entry. A
    study samples them only where it names one of these."""
    impact_speed_m_s: Annotated[float, Field(ge=0.0, le=100.0)] = 0.01
    """Speed of the first approach above which the contact of a roller and a pocket wall is an impact."""
    fatigue_exponent: Annotated[float, Field(ge=1.0, le=20.0)] = 8.0
    """Exponent m of the S-N curve of the cage, by which impact_fatigue_force_N weighs the peak forces of impacts."""

    stress_concentration: Annotated[float, Field(ge=1.0, le=10.0)] = 2.0
    """Stress at the corner of a pocket, relative to a smooth bar, for bar_stress_MPa."""


class Verdict(Sparse):
    """Limits between the classes of a cage by its orbit; no motion depends on them. Radii count over the radial play of what guides
    the cage, rates over its speed."""

    trace: bool = True
    """Whether runs trace the cage orbit, 64 samples a cage turn, and results state its class; false leaves both out. In a
    study all runs trace it if limits.cage.verdict names classes, otherwise only the confirmation runs."""
    still_radius: Share = Thresholds.still_radius
    """Rms radius of the orbit below which the cage is held. A cage is also held if the centre of its orbit is farther than
    this radius from the centre of its guide."""
    moving_radius: Share = Thresholds.moving_radius
    """Rms radius of the orbit from which a cage circles or is in fast whirl."""
    concentration: Share = Thresholds.concentration
    """Share of the orbit's spectrum in its main line from which a cage circles or is in fast whirl."""
    lowest_rate: Annotated[float, Field(ge=-1e3, le=0.0)] = Thresholds.lowest_rate
    """Rate of the orbit, divided by the cage speed, below which a cage is in fast whirl. Negative rates are against its
    rotation."""
    highest_rate: Annotated[float, Field(ge=0.0, le=1e3)] = Thresholds.highest_rate
    """Rate of the orbit, over the speed of the cage, above which a cage is in fast whirl. A film on a ring that turns drives cages
    up to half the sum of both speeds, which counts where it is more."""
    forced_band: Share = Thresholds.forced_band
    """Relative distance from the order of a force (an imbalance, a ring) within which the orbit is forced. Then the cage
    circles."""
    rattling_turnover: Positive | None = Thresholds.rattling_turnover
    """Work of friction and damping in a cage turn, over the energy of its rotation, above which a cage rattles. Below it wanders. No
    value is known: without one a cage that neither holds still nor goes round is not judged."""
    least_share: Annotated[float, Field(gt=0.5, lt=1.0)] = Thresholds.least_share
    """Share of bearings alike that a class must have, by its replicates, for the verdict to name it. Six replicates alike bear 0.85."""

    def unsaved(self) -> Mapping[str, Any]:
        return {key: field.default for key, field in type(self).model_fields.items()}

    @property
    def limits(self) -> Thresholds:
        """The limits between the classes."""
        return Thresholds(**{key: value for key, value in self if key != "trace"})


class Numerics(Consistent, Sparse):
    """Tolerance, length and replication of a run."""

    UNSAVED: ClassVar[Mapping[str, Any]] = {"stiffness": True}

    method: Literal["auto", "rk45", "verlet", "rosenbrock"] = "auto"
    """Integrator. verlet: explicit, velocity Verlet with one right-hand side a step. rk45: explicit, Dormand-Prince, for tight
    tolerances: below 1e-3 the second order of verlet costs more. rosenbrock: linearly implicit, RODAS4, for scenes where stability
    limits explicit steps. auto: verlet at rtol 5e-3 and above and rk45 below, unless a trial at the start of a run shows that
    rosenbrock is cheaper."""
    rtol: Annotated[float, Field(ge=1e-13, le=0.1)] = 1e-2
    """Relative tolerance of a step: the error in approach and speed of a raceway contact at its mean load share. Effect:
    errors at 1e-2 for the bearing of Chen et al. 2022 are impact +0.1 +- 0.4 %, whirl +0.2 +- 0.9 %, loss -0.01 +- 0.02 %.
    At 1e-1 they are -0.9, -4.0 and +0.09 % (compared with verlet at 1e-4)."""
    turns: Annotated[float, Field(gt=0.0, le=1e6)] = 100
    """Shaft turns that are counted, after discard_turns."""
    discard_turns: Annotated[float, Field(ge=0.0, le=1e6)] | Literal["auto"] = 20.0
    """Shaft turns before the counted ones, discarded as transient. "auto" detects the transient in the series of the run, at
    least one batch."""
    extend: bool = True
    """Double the run until its results have settled, and count its second half. Results have settled when replicates that
    start in two different ways agree, and both halves of the counted turns agree. Only whole impact windows count."""
    extend_limit: Annotated[float, Field(ge=1.0, le=1000.0)] = 8.0
    """Longest run with extend, as a multiple of turns."""
    replicates: Annotated[int, Field(ge=1, le=10000)] = 8
    """Number of runs of the scene from different starts. Effect: their scatter gives the statistical error. Every second run
    starts with slip, its cage near the guide and its rollers at one side of their pockets, so that runs which have not settled
    differ."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of all random starts and deviations. Scenes with equal values, seed and version give identical results."""
    impact_window_turns: Annotated[float, Field(gt=0.0), NotVanishing] = 20
    """Window of the largest impact force, which grows with the observed time. The result is the mean over several windows."""
    samples_per_turn: Annotated[int, Field(ge=8, le=100000)] = 512
    """Samples of the motion in a shaft turn, for whirl and histories."""
    whirl_cutoff_hz: Positive | None = None
    """Cutoff of a low-pass filter for the whirl deviation ratio, as in a test rig. The cage's centre is sampled ten times in a
    period of the cutoff and filtered forward and backward. Default: no filter, since integrated velocities have no noise."""
    whirl_notches_hz: list[Positive] = []
    """Frequencies removed from the filtered whirl, such as the runout of a rig at cage and shaft rotation. A notch acts where a
    run has ten periods of it."""
    companion: bool = True
    """Repeat a share of the replicates at ten times the tolerance to estimate the numerical error. Where stability limits the
    steps of a slow bearing, they are repeated with steps that resolve its light contacts instead."""
    companion_share: Share = 0.25
    """Share of the replicates that companion repeats. Effect: with more of them the numerical error is better known and the
    run takes longer."""
    stiffness: bool = True
    """Compute the stiffness by static loads after the runs: some 20 ms, nine times as long with a heat balance. A study
    computes it only if it names one of its results."""
    step_budget_per_turn: Annotated[int, Field(ge=100)] = 100_000
    """Largest number of steps in a shaft turn before a run fails, with place and reason. Verlet may take six times as many, as its
    steps cost a sixth. With 10 rollers in one slice the default takes about 1 s a turn (8 us a step on one core). With 80 rollers
    in 31 slices it takes 4 s (0.04 ms a step), between tilted rings 7 s."""

    @property
    def warm_up_turns(self) -> float:
        """Turns before the counted ones; with "auto" the detected transient may be shorter or longer."""
        return AUTO_WARM_UP_TURNS if self.discard_turns == "auto" else float(self.discard_turns)

    @property
    def companions(self) -> int:
        """Number of repeated replicates."""
        return math.ceil(self.companion_share * self.replicates - 1e-9) if self.companion else 0

    @property
    def most_batches(self) -> int:
        """Most batches of each replicate and companion in memory."""
        return MOST_KEPT // (self.replicates + self.companions)

    def faults(self) -> Iterator[str]:
        if self.whirl_notches_hz and self.whirl_cutoff_hz is None:
            yield "numerics.whirl_notches_hz: a notch needs the filter of numerics.whirl_cutoff_hz; give that too"
        if min(self.turns, MOST_OF_A_RUN) + min(self.warm_up_turns, MOST_OF_A_RUN) > self.most_batches:
            yield (
                f"turns = {self.turns:g}: {self.replicates + self.companions} replicates and companions have memory "
                f"for {self.most_batches} turns each, warm-up included; take fewer turns or replicates"
            )
