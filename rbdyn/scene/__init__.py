"""One validated scene: bearing, cage, lubricant, operation, laws and numerics.

Keys carry their units, and each default has a reason. Nothing here is compiled: ``rbdyn.dynamics.parameters.model`` turns a
scene into the SI parameters of the kernels. ``Scene``, a roller bearing, is in this file.

- ``bearing``: drawing of bearing and cage, materials; ``operation``: speeds, loads, support, mounting
- ``lubricant``: oil and traction; ``laws``: laws of the interactions, and numerics
- ``ball``, ``form_errors``: scene of a ball bearing; ``reading``: scenes from files and tables
- ``thermal``: heat balance and warming of a cold machine; ``input_ranges``: what the unknown inputs of the balance leave open
- ``geometry``: radii, masses and speeds; ``fits``: rings, clearances and grooves as mounted; ``notes``: suspicious values
- ``uncertain``: declared unknown inputs; ``unknown``: the unknown inputs of a scene; ``keys``: descriptions of all keys,
  and columns of tables named by them; ``duty``: points of operation
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, cast

from pydantic import BaseModel, Field, model_validator

from rbdyn.base.faults import LONGEST_NAME, InputError, one_line
from rbdyn.base.notes import Notes
from rbdyn.properties.materials import Material, Oil, equivalent_modulus
from rbdyn.scene.ball import BALL_KINDS, BallScene
from rbdyn.scene.bearing import (
    STIFFNESS,
    Bearing,
    Cage,
    Materials,
    material_of,
    section_misfits,
    section_notes,
    section_of,
    with_bar_stiffness_of_section,
)
from rbdyn.scene.laws import (
    MOST_SAMPLES,
    SAMPLES_A_PERIOD,
    SLOWEST_CAGE,
    Damage,
    Laws,
    Numerics,
    Verdict,
    with_bar_stiffness_of_cage,
)
from rbdyn.scene.lubricant import (
    RHEOLOGY_OILS,
    Lubricant,
    Traction,
    fraction_faults,
    with_fraction_of_flow,
    with_traction_of_oil,
)
from rbdyn.scene.notes import catalogue_entry, catalogue_notes, unit_notes
from rbdyn.scene.operation import Mounting, Operation, Support, misfits
from rbdyn.scene.reading import SceneFile
from rbdyn.scene.thermal import (
    FilmTemperatures,
    Thermal,
    film_temperatures,
    oil_ceiling,
    start_faults,
    thermal_faults,
    with_first_guess,
)
from rbdyn.scene.uncertain import Calibrate, Uncertain
from rbdyn.verdict.orbits import SAMPLES_A_TURN

if TYPE_CHECKING:
    from rbdyn.mounting.cage import CageClearances, OperatingClearance, RunningClearance
    from rbdyn.mounting.rings import MountedClearance
    from rbdyn.scene.geometry import Geometry

# Slices where a profile or a tilt needs them (ISO/TS 16281 asks for at least 30).
PROFILE_SLICES = 31


class Scene(SceneFile):
    """Validated input of the simulation of a cylindrical roller bearing, with units in the names of the keys.

    ``Scene.load("SCENE.toml")`` reads a file; ``Scene.from_dict(tables)`` and ``Scene(bearing={...}, cage={...}, ...)`` take
    tables in the form of TOML; ``scene.changed({"cage.mass_g": 50.0})`` is a copy with other values. Tables of a ball bearing
    give a BallScene. A scene never changes; ``scene.cage.mass_g`` reads a key. Bad input raises InputError with all faults at
    once: key, value and fix. ``rbdyn keys`` lists all keys. ``rbdyn.simulate(scene)`` runs it, ``rbdyn.history(scene, turns)``
    returns its motion, ``rbdyn.equilibrium(scene)`` is for balls; each of them also takes the path of a file.

    bearing, cage, lubricant, operation : drawings, oil, speeds and loads; required.
    mounting, support, thermal : fits and temperatures, a flexible housing, a heat balance; optional.
    materials, traction, model, damage, verdict, numerics : with defaults.
    """

    UNSAVED: ClassVar[Mapping[str, Any]] = {"thermal": None, "damage": {}, "verdict": {}}

    bearing: Bearing
    """Dimensions of the bearing, as on its drawing."""
    cage: Cage
    """Dimensions of the cage, as on its drawing."""
    lubricant: Lubricant
    """Oil and lubrication method."""
    operation: Operation
    """Speeds and loads."""
    mounting: Mounting | None = None
    """Fits, temperatures, shaft and housing; without it the stated clearances are those in operation."""
    support: Support | None = None
    """Flexible, damped support of the outer ring; without it the ring is fixed."""
    thermal: Thermal | None = None
    """Heat balance that computes the temperatures; Default: temperatures are given by lubricant and mounting. Needs [mounting]
    with bore, outside and housing diameter and the width of the rings, and without temperatures of parts. Also needs
    lubricant.oil_flow_l_min with oil_inlet_temperature_C, or a lubricant.supply without a flow: bath, drop, oil_air or grease.
    rbdyn new --ambient 25 writes all of this."""
    materials: Materials = Materials()
    """Material of each part."""
    traction: Traction = Traction()
    """Traction of the raceways."""
    model: Laws = Laws()
    """Law of each interaction."""
    damage: Damage = Damage()
    """Inputs of the damage results."""
    verdict: Verdict = Verdict()
    """Limits between the classes of a cage by its orbit."""
    numerics: Numerics = Numerics()
    """Tolerance, length and replication of a run."""
    uncertain: Annotated[Uncertain | None, Field(exclude=True)] = None
    """Unknown inputs of the scene; no run depends on them."""
    calibrate: Annotated[Calibrate, Field(exclude=True)] = Calibrate()
    """Settings of doe calibrate, which estimates the unknown inputs; no run depends on it."""

    @classmethod
    def _of_kind(cls, data: dict[str, Any]) -> type[Self]:
        bearing = data.get("bearing")
        if isinstance(bearing, dict) and bearing.get("kind") in BALL_KINDS:
            # Scene.load reads any scene; ``rollers_only`` restricts it to rollers.
            return cast(type[Self], BallScene._of_kind(data))
        return cls

    @model_validator(mode="before")
    @classmethod
    def _defaults_by_other_tables(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        tables = {
            name: table.model_dump(exclude_unset=True) if isinstance(table, BaseModel) else table
            for name, table in data.items()
        }
        warm = with_first_guess(with_fraction_of_flow(with_traction_of_oil(tables)))
        return with_bar_stiffness_of_cage(with_bar_stiffness_of_section(warm))

    def faults(self) -> list[str]:
        """Contradictions of the scene, each with a slip of the unit that may be its cause."""
        faults = list(self._misfits())
        faults += (
            misfits(self.mounting, self.bearing, self.bearing.roller_length_mm) if self.mounting is not None else ()
        )
        faults += self._overload_faults()
        faults += thermal_faults(self.thermal, self.lubricant, self.mounting, self.bearing.designation)
        if self.thermal is not None:
            listed, ceiling = catalogue_entry(self.bearing), oil_ceiling(self.thermal, self.lubricant)
            reference = None if listed is None else listed[1].reference_speed
            faults += start_faults(self.thermal.start, self.lubricant, self.thermal.ambient_C, ceiling, reference)
        if self.thermal is not None and self.operation.schedule is not None:
            faults.append(
                "operation.schedule: [thermal] balances the heat of a steady speed and load; leave out one of them"
            )
        if not faults and (seizures := list(self._seizures())):
            temperature_notes = [note for note in self.unit_notes if note.startswith("mounting.")]
            return ["; ".join([seizure, *temperature_notes]) for seizure in seizures]
        slips = {note.partition(" = ")[0]: note for note in (self.unit_notes if faults else ())}
        return ["; ".join([fault, *(slips[key] for key in slips if key in fault)]) for fault in faults]

    def _misfits(self) -> Iterator[str]:
        bearing, cage, laws = self.bearing, self.cage, self.model
        chord = bearing.pitch_diameter_mm * math.sin(math.pi / bearing.rollers)
        web = chord - bearing.roller_diameter_mm - cage.pocket_clearance_mm
        if web <= 0.0:
            yield (
                f"cage.pocket_clearance_mm = {cage.pocket_clearance_mm:g}: leaves no cross-bar between "
                f"{bearing.rollers} pockets ({web:.4g} mm); make it smaller or take fewer rollers"
            )
        yield from section_misfits(bearing, cage)
        if laws.guide_land == "film" and cage.guidance != "roller":
            radial_um = 500.0 * (cage.guide_clearance_mm or 0.0)
            if laws.land_film_floor_um >= radial_um:
                yield (
                    f"model.land_film_floor_um = {laws.land_film_floor_um:g}: not below the radial guide clearance of "
                    f"{radial_um:g} um; lower it, widen cage.guide_clearance_mm or set model.guide_land = 'dry'"
                )
        if self.traction.elasticity and self.numerics.method == "rosenbrock":
            yield (
                "numerics.method = 'rosenbrock' and traction.elasticity = true contradict each other: the implicit method has no "
                "traction coefficients as states; set the method to 'auto'"
            )
        length = cage.pocket_contact_length_mm
        if length is not None and length > bearing.roller_length_mm:
            yield (
                f"cage.pocket_contact_length_mm = {length:g}: longer than the roller of {bearing.roller_length_mm:g} mm; shorten it "
                "or lengthen bearing.roller_length_mm"
            )
        floor, half_pocket_um = laws.pocket_film_floor_um, 500.0 * cage.pocket_clearance_mm
        if laws.pocket_film and floor >= half_pocket_um:
            yield (
                f"model.pocket_film_floor_um = {floor:g}: not below half the pocket clearance of {half_pocket_um:g} um; "
                "lower it or widen cage.pocket_clearance_mm"
            )
        if laws.slices == 1 and self.needs_slices:
            yield (
                f"model.slices = 1 contradicts bearing.roller_profile = {bearing.roller_profile!r} with bearing.tilt_mrad = "
                f"{bearing.tilt_mrad:g}: one slice shows neither profile nor tilt; leave model.slices out"
            )
        rheology = self.traction.rheology_oil or self.lubricant.oil
        if self.traction.model == "thermal_newtonian" and rheology not in RHEOLOGY_OILS:
            yield (
                f"traction.model = 'thermal_newtonian': has no constants of {rheology}; set traction.rheology_oil to a similar oil, "
                "or take 'limiting_shear'"
            )
        yield from self._tilt_faults()
        yield from fraction_faults(self.lubricant, self.bearing.pitch_diameter_mm, *self.operation.speeds_rpm)
        land = self.land_diameter_mm
        inner = bearing.pitch_diameter_mm - bearing.roller_diameter_mm
        outer = bearing.pitch_diameter_mm + bearing.roller_diameter_mm
        if cage.guidance != "roller" and not inner < land < outer:
            yield f"cage.land_diameter_mm = {land:g}: not between the raceways of {inner:g} and {outer:g} mm; fix it"
        yield from self._sampling_faults()

    def _sampling_faults(self) -> Iterator[str]:
        """Faults of samples that the run or memory is too short for."""
        numerics = self.numerics
        if numerics.turns * numerics.samples_per_turn < 2:
            yield f"numerics.turns = {numerics.turns:g}: shorter than two samples; lengthen the run"
        seconds = self.turn_s * (numerics.turns + numerics.warm_up_turns)
        if numerics.whirl_cutoff_hz is not None and numerics.whirl_cutoff_hz * seconds < 1.0:
            yield (
                f"numerics.whirl_cutoff_hz = {numerics.whirl_cutoff_hz:g}: its period is longer than the run of {seconds:.3g} s; "
                "raise it or lengthen numerics.turns"
            )
        samples = self.whirl_samples_per_turn * (numerics.turns + numerics.warm_up_turns)
        if samples * (numerics.replicates + numerics.companions) > MOST_SAMPLES:
            yield (
                f"numerics.whirl_cutoff_hz = {numerics.whirl_cutoff_hz:g}: needs {samples:.3g} samples a replicate, but memory holds "
                f"{MOST_SAMPLES:g} in all; lower it or take fewer turns or replicates"
            )

    def _seizures(self) -> Iterator[str]:
        """Faults of cage clearances that fits, temperature and rotation reduce to the floor of their film."""
        if self.mounting is None or self.cage_clearances is None:
            return
        shift = self.cage_clearances.shift
        for name, (key, play, touching, _) in self.running_clearances(self.mounting).items():
            if play.operating > touching:
                continue
            if name == "lip":
                yield (
                    f"{key} = {1e3 * play.drawn:g}: the pocket circle grows {1e6 * shift:+.1f} um relative to the roller circle, but "
                    f"the lips allow {0.5e6 * play.operating + abs(1e6 * shift):.1f} um; widen it or check the temperatures of mounting"
                )
                continue
            floor = (
                f", not above twice model.{'land' if name == 'guide' else name}_film_floor_um = {0.5e6 * touching:g}"
            )
            yield (
                f"{key} = {1e3 * play.drawn:g}: fits {1e6 * play.fit:+.1f} um, temperature {1e6 * play.temperature:+.1f} um and "
                f"rotation {1e6 * play.rotation:+.1f} um leave {1e6 * play.operating:.1f} um{floor if touching else ''}: the cage "
                "seizes; widen it or check the temperatures of mounting"
            )

    def running_clearances(self, mounting: Mounting) -> "dict[str, RunningClearance]":
        """Clearances in operation with another mounting, at the speeds of the scene, with how little of each may be left.

        By name: "radial", "guide", "pocket", and under guidance by the rollers "lip": what the lips allow less what the circle of
        pockets grows. Those between parts that the model's laws leave out are none.
        """
        from rbdyn.mounting.cage import OperatingClearance, RunningClearance

        bearing, laws, cage = self.bearing, self.model, self._cage_clearances(mounting)
        radial, pitch = self._mounted_clearance(mounting), bearing.pitch_diameter
        rings, body, roller = (self.material(part).thermal_expansion for part in ("rings", "cage", "roller"))
        play = OperatingClearance(
            radial.initial, radial.inner_fit + radial.outer_fit, radial.temperature, radial.rotation
        )
        running = {"radial": RunningClearance("bearing.radial_clearance_mm", play, -math.inf, rings * pitch)}
        lands = {"film": 2e-6 * laws.land_film_floor_um, "dry": 0.0}
        if cage.guide is not None and laws.guide_land in lands:
            growth = max(body, rings) * 1e-3 * self.land_diameter_mm
            running["guide"] = RunningClearance("cage.guide_clearance_mm", cage.guide, lands[laws.guide_land], growth)
        if laws.pocket == "contact":
            film, growth = (
                2e-6 * laws.pocket_film_floor_um * laws.pocket_film,
                max(body, roller) * bearing.roller_diameter,
            )
            running["pocket"] = RunningClearance("cage.pocket_clearance_mm", cage.pocket, film, growth)
            if cage.lip is not None:
                allowed = cage.lip._replace(temperature=cage.lip.temperature - 2.0 * abs(cage.shift))
                running["lip"] = RunningClearance(
                    "cage.pocket_radial_clearance_mm", allowed, 0.0, max(body, rings) * pitch
                )
        return running

    def _overload_faults(self) -> Iterator[str]:
        """Fault of a load 5 F/Z (Stribeck) on one roller whose contact would be wider than its diameter."""
        bearing, load = self.bearing, self.operation.largest_load_N
        modulus = 1e-6 * equivalent_modulus(self.material("roller"), self.material("rings"))
        diameter, length = bearing.roller_diameter_mm, bearing.effective_length_mm
        radius = 0.5 * diameter * (1.0 - diameter / bearing.pitch_diameter_mm)
        width = math.sqrt(32.0 * 5.0 * load / bearing.rollers * radius / (math.pi * length * modulus))  # Hertz
        if width >= diameter:
            yield (
                f"operation.radial_load_N = {load:g}: a roller of {diameter:g} mm would have a contact {width:.3g} mm wide; reduce "
                "the load or check its unit"
            )

    def _tilt_faults(self) -> Iterator[str]:
        """Fault of a tilt at which a roller under the whole load touches over less than a slice."""
        bearing = self.bearing
        share = max(bearing.inner_tilt_share, 1.0 - bearing.inner_tilt_share)
        tilt, length = abs(bearing.tilt) * share, bearing.effective_length
        load = self.operation.largest_load_N
        if tilt < 1e-12 or load == 0.0:  # such a tilt moves the ends by less than an atom
            return
        from rbdyn.contact.hertz_line import palmgren

        stiffness = palmgren(equivalent_modulus(self.material("roller"), self.material("rings")), length).stiffness
        # Q = K/l int_0^c (tilt x)^(10/9) dx = (9/19) K/l tilt^(10/9) c^(19/9)
        contact = (19.0 / 9.0 * load * length / (stiffness * tilt ** (10.0 / 9.0))) ** (9.0 / 19.0)
        if contact < length / (self.model.slices or PROFILE_SLICES):
            yield (
                f"bearing.tilt_mrad = {bearing.tilt_mrad:g}: even under {load:g} N a roller would touch over {contact * 1e3:.2g} mm "
                f"of {bearing.effective_length_mm:g} mm; reduce the tilt"
            )

    @property
    def summary(self) -> str:
        """The scene in one line, with the clearance of the drawing."""
        bearing, point = self.bearing, self.operation
        return (
            f"{bearing.rollers} rollers of {bearing.roller_diameter_mm:g} x {bearing.roller_length_mm:g} mm, diametral clearance "
            f"{bearing.radial_clearance_mm:g} mm, {point.inner_speed_rpm:g} rpm, {point.radial_load_N:g} N radial"
        )

    @property
    def mounted_clearance_mm(self) -> float:
        """Diametral clearance in operation [mm]: that of the drawing, changed by mounting, temperature and speed."""
        mounted = self.mounted_clearance
        return self.bearing.radial_clearance_mm if mounted is None else mounted.operating * 1e3

    @cached_property
    def geometry(self) -> "Geometry":
        """Radii, masses and speeds as mounted."""
        from rbdyn.scene.geometry import geometry_of

        return geometry_of(self)

    @property
    def mounted_clearance(self) -> "MountedClearance | None":
        """Radial clearance with the effects of fits, temperature and rotation; None where the scene has no mounting."""
        return None if self.mounting is None else self._mounted_clearance(self.mounting)

    @property
    def cage_clearances(self) -> "CageClearances | None":
        """Cage clearances with the effects of fits, temperature and rotation; None where the scene has no mounting."""
        return None if self.mounting is None else self._cage_clearances(self.mounting)

    def _mounted_clearance(self, mounting: Mounting) -> "MountedClearance":
        from rbdyn.scene.fits import operating_clearance

        def worked_out() -> "MountedClearance":
            return operating_clearance(mounting, self.bearing, self.materials, *self.operation.speeds)

        return self.once("_mounted", worked_out) if mounting is self.mounting else worked_out()

    def _cage_clearances(self, mounting: Mounting) -> "CageClearances":
        from rbdyn.scene.fits import RunningSpeeds, cage_clearances

        speeds = RunningSpeeds(*self.operation.speeds, self.geometry.motion.cage_speed)
        land = 1e-3 * self.land_diameter_mm
        return cage_clearances(mounting, self.bearing, self.cage, self.materials, land, speeds)

    def clearances_of(self, mounting: Mounting) -> dict[str, float]:
        """Diametral clearances in operation [m] "radial", "guide" (not under guidance by the rollers) and "pocket" with another mounting,
        at the speeds of the scene."""
        cage = self._cage_clearances(mounting)
        plays = {"radial": self._mounted_clearance(mounting), "guide": cage.guide, "pocket": cage.pocket}
        return {name: play.operating for name, play in plays.items() if play is not None}

    @property
    def clearances(self) -> "dict[str, OperatingClearance | None]":
        """Diametral clearances [m] "radial", "guide" (None where the rollers guide the cage) and "pocket", on the drawing and in
        operation."""
        from rbdyn.mounting.cage import OperatingClearance

        radial, cage = self.mounted_clearance, self.cage_clearances
        if radial is None or cage is None:
            play = None if self.cage.guidance == "roller" else self.cage.guide_clearance
            nominal = self.bearing.radial_clearance, play, self.cage.pocket_clearance
            plays = [None if clearance is None else OperatingClearance(clearance) for clearance in nominal]
        else:
            fit = radial.inner_fit + radial.outer_fit
            bearing = OperatingClearance(radial.initial, fit, radial.temperature, radial.rotation)
            plays = [bearing, cage.guide, cage.pocket]
        return dict(zip(("radial", "guide", "pocket"), plays, strict=True))

    @property
    def unit_notes(self) -> Notes:
        """Sentences on values that look like another unit."""
        cage, stiffness = self.material("cage"), self.model.pocket_bar_stiffness_N_m
        return unit_notes(self.bearing, self.cage, self.lubricant, self.mounting, cage, stiffness)

    @property
    def section_notes(self) -> Notes:
        """A sentence on the stiffness of the cage's bars, where it follows from their section."""
        if STIFFNESS in self._tables.get("model", {}):
            return ()
        return section_notes(self.bearing, self.cage, self.model.pocket_bar_stiffness_N_m)

    @property
    def catalogue_notes(self) -> Notes:
        """A sentence on dimensions that contradict the designation; none without a designation."""
        return catalogue_notes(self.bearing, self.mounting)

    @property
    def needs_slices(self) -> bool:
        """Whether a roller needs slices: it has a profile or its races are tilted."""
        return self.bearing.roller_profile != "cylinder" or self.bearing.tilt_mrad != 0.0

    @property
    def slices(self) -> int:
        """Number of slices of a roller: stated, else one, or more for a profile or tilt."""
        return self.model.slices or (PROFILE_SLICES if self.needs_slices else 1)

    @property
    def land_diameter_mm(self) -> float:
        """Diameter of the guide land, stated or estimated [mm]."""
        if self.cage.land_diameter_mm is not None:
            return self.cage.land_diameter_mm
        side = {"outer": 1.0, "inner": -1.0, "roller": 0.0}[self.cage.guidance]
        return self.bearing.pitch_diameter_mm + side * 2.0 / 3.0 * self.bearing.roller_diameter_mm

    @property
    def guide_clearance_m(self) -> float | None:
        """Radial clearance of the cage in its land in operation [m]; None where no land guides it."""
        clearance = self.guide_play_m
        landless = self.cage.guidance == "roller" or self.model.guide_land == "off"
        return None if landless or clearance is None else 0.5 * clearance

    @property
    def bar_stress_MPa_N(self) -> float | None:  # noqa: N802
        """Stress in a clamped bar of the cage per load of a roller, with its concentration [MPa/N]; None without a section."""
        section = section_of(self.bearing, self.cage)
        if section is None:
            return None
        from rbdyn.contact.cage_bar import clamped_stress

        contact = self.cage.pocket_contact_length or self.bearing.effective_length
        return 1e-6 * self.damage.stress_concentration * clamped_stress(section, min(contact, section.bar_length))

    @property
    def cage_play_m(self) -> float | None:
        """Radial clearance of the cage [m] in its land, or at the pocket lips of guiding rollers; None without either."""
        lips = self.lip_clearance_m
        if self.guide_clearance_m is None:
            return None if lips is None else 0.5 * lips
        return self.guide_clearance_m

    @property
    def orbit_play_m(self) -> float:
        """Radial play [m] of the cage in its land, or in the pockets of the rollers that guide it."""
        return 0.5 * self.pocket_clearance_m if self.guide_clearance_m is None else self.guide_clearance_m

    @property
    def cage_sample_s(self) -> float | None:
        """Time between two samples of the cage's orbit [s]; None where the scene leaves them out: by its [verdict], by a schedule, and
        without anything that guides the cage or turns it."""
        speed = abs(self.geometry.motion.cage_speed)
        guided = self.guide_clearance_m is not None or self.model.pocket != "off"
        if not (self.verdict.trace and guided and self.operation.schedule is None and self.orbit_play_m > 0.0):
            return None
        return 2.0 * math.pi / (SAMPLES_A_TURN * speed) if speed > SLOWEST_CAGE else None

    @property
    def cage_turns(self) -> float:
        """Turns of a cage without slip in the counted turns of a run."""
        return self.numerics.turns * self.turn_s * abs(self.geometry.motion.cage_speed) / (2.0 * math.pi)

    @property
    def guide_play_m(self) -> float | None:
        """Diametral guide clearance in operation [m], also where the land is off; None without a guide."""
        mounted = self.cage_clearances
        if mounted is None or mounted.guide is None:
            return self.cage.guide_clearance
        return mounted.guide.operating

    @property
    def pocket_clearance_m(self) -> float:
        """Pocket width less roller diameter in operation [m]."""
        mounted = self.cage_clearances
        return self.cage.pocket_clearance if mounted is None else mounted.pocket.operating

    @property
    def lip_clearance_m(self) -> float | None:
        """Radial clearance between roller and lips in operation, both directions together [m]; None where a ring guides the
        cage."""
        mounted = self.cage_clearances
        return self.cage.lip_clearance if mounted is None or mounted.lip is None else mounted.lip.operating

    @property
    def cage_temperature_C(self) -> float | None:  # noqa: N802
        """Temperature of the cage, stated or by default [C]; None where the scene has no mounting."""
        if self.mounting is None:
            return None
        from rbdyn.scene.fits import cage_temperature_rise, mounted_rings

        material = self.material("rings")
        rings = mounted_rings(self.mounting, self.bearing, material, material, 0.0)
        return self.mounting.reference_temperature_C + cage_temperature_rise(self.mounting, self.cage.guidance, rings)

    @cached_property
    def film_temperatures_C(self) -> FilmTemperatures:  # noqa: N802
        """Temperatures of the oil in the cavity and in the films [C]."""
        if self.mounting is None or self.lubricant.film_temperature == "oil":
            return film_temperatures(self, None)
        from rbdyn.scene.fits import mounted_rings

        material = self.material("rings")
        return film_temperatures(self, mounted_rings(self.mounting, self.bearing, material, material, 0.0))

    def oil(self, place: str = "cavity") -> Oil:
        """The oil in the "cavity", or in the films of the "outer" and "inner" race, of the "pocket" and of the "land"."""
        return self.lubricant.at(getattr(self.film_temperatures_C, place))

    @property
    def turn_s(self) -> float:
        """Duration of one shaft turn [s]."""
        return self.operation.turn_s

    @property
    def extends(self) -> bool:
        """Whether runs are extended until they settle, which those of a schedule never do."""
        return self.numerics.extend and self.operation.schedule is None

    @property
    def whirl_samples_per_turn(self) -> int:
        """Samples of the cage's centre in a shaft turn for the filtered whirl; 0 without a filter."""
        cutoff = self.numerics.whirl_cutoff_hz
        # At least the lower limit of numerics.samples_per_turn, so that every batch has samples.
        return 0 if cutoff is None else max(math.ceil(SAMPLES_A_PERIOD * cutoff * self.turn_s), 8)

    @property
    def impact_window_turns(self) -> float:
        """Window of the largest force: as stated, or the whole run where that is shorter."""
        return min(self.numerics.impact_window_turns, self.numerics.turns)

    def material(self, part: str) -> Material:
        """Material of 'roller', 'rings' or 'cage' in SI."""
        return material_of(getattr(self.materials, part))


class DrawnScene(Scene):
    """A scene as drawn, which may seize in operation: for looking at its clearances, not for runs."""

    def _seizures(self) -> Iterator[str]:
        return iter(())


def scene_of(source: Scene | BallScene | Path | str, overrides: Iterable[str] = ()) -> Scene | BallScene:
    """The scene itself, or that of a file, with ``key.path=value`` overrides.

    Raises InputError for anything else, for the faults of the file and for those of the overrides.
    """
    if isinstance(source, Scene | BallScene):
        return source.overridden(overrides) if overrides else source
    if isinstance(source, str | PathLike):
        return Scene.load(Path(source), overrides)
    raise InputError(
        f"scene = {one_line(repr(source), LONGEST_NAME)}: must be a Scene or the path of a scene file; Scene.from_dict takes "
        "tables"
    )


def rollers_only(source: Scene | BallScene | Path | str, overrides: Iterable[str] = ()) -> Scene:
    """The scene, as ``scene_of``, of a roller bearing. Raises InputError for a ball bearing."""
    scene = scene_of(source, overrides)
    if isinstance(scene, Scene):
        return scene
    raise InputError(f"bearing.kind = {scene.bearing.kind!r}: is not simulated in time; use rbdyn ball")


def balls_only(source: Scene | BallScene | Path | str, overrides: Iterable[str] = ()) -> BallScene:
    """The scene, as ``scene_of``, of a ball bearing. Raises InputError for a roller bearing."""
    scene = scene_of(source, overrides)
    if isinstance(scene, BallScene):
        return scene
    raise InputError(f"bearing.kind = {scene.bearing.kind!r}: has no balls; use rbdyn simulate")
