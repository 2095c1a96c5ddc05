"""Temperatures of a mounted bearing: keys of its start and of the heat balance, their contradictions, and a scene at temperatures.

The balance itself is in ``rbdyn.thermal``. A scene at temperatures has no balance any more: its parts and its oil have stated
temperatures, and its films have those of their surfaces.
"""

from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

from pydantic import Field

from rbdyn.base.faults import Consistent, InputError, InSI, NonNegative, Positive, Share, Sparse, Strict, given
from rbdyn.scene.lubricant import HOTTEST_C, THICKEST, Lubricant, OilCelsius
from rbdyn.scene.operation import SLOWEST_RPM, Load, Mounting, schedule_faults

if TYPE_CHECKING:
    from rbdyn.mounting.rings import MountedRings
    from rbdyn.properties.materials import Oil
    from rbdyn.result import SimulationResult
    from rbdyn.scene import Scene
    from rbdyn.thermal.start import Course

MOST_POINTS = 60
# Speed over the reference speed of a catalogue, above which a unit is wrong or the bearing is another one.
MOST_OF_REFERENCE = 2.0
# Longest schedule [s]: a week.
LONGEST = 7.0 * 24.0 * 3600.0
# Keys of [thermal.start] that state temperatures at the start.
ORIGINS = ("from_C", "from_parts_C", "from_point")
# Lengths in widths of the bearing; longer ones warm for years.
Widths = Annotated[Positive, Field(le=1000.0)]
Pace = Annotated[float, Field(ge=0.0, le=1e6)]


class StartSchedule(Consistent):
    """Speed and load over time: linear between the points, constant after the last. A step takes two points a second apart."""

    time_s: Annotated[list[NonNegative], Field(min_length=1, max_length=MOST_POINTS)]
    """Times of the points from the start of the machine, the first 0."""
    speed_rpm: list[Pace] | None = None
    """Speed of the inner ring at each time, without a sign. Where the inner ring is at rest it is the speed of the outer ring.
    The other ring keeps the ratio of [operation]. Default: the speed of [operation]."""
    load_N: list[Load] | None = None  # noqa: N815
    """Radial load at each time. Default: the load of [operation]."""
    speed = InSI[list[float] | None]("rpm")

    def faults(self) -> Iterator[str]:
        times, name = self.time_s, "thermal.start.schedule"
        if times[0] != 0.0:
            yield f"{name}.time_s: begins at {times[0]:g} s; give the speed and load of the start at 0"
        if times[-1] > LONGEST:
            yield f"{name}.time_s: ends after {times[-1]:g} s, more than a week ({LONGEST:g} s); give seconds"
        yield from schedule_faults(name, times, {"speed_rpm": self.speed_rpm, "load_N": self.load_N})
        if self.speed_rpm is not None and len(self.speed_rpm) == len(times) and max(self.speed_rpm) < SLOWEST_RPM:
            yield f"{name}.speed_rpm: the machine stands still at every time; give a speed of at least {SLOWEST_RPM:g}"


class Start(Strict):
    """Warming of a cold machine: temperatures and clearances over time until they are steady. Rings warm before the housing, so
    clearances are often least after one to five minutes.

    The heat of rollers follows a few short simulations, at most ten, from which it is interpolated over temperature, speed and load;
    that of balls is SKF's friction at every moment.
    """

    from_C: OilCelsius | None = None  # noqa: N815
    """Temperature of all parts and of the oil at the start. Default: thermal.ambient_C."""
    from_parts_C: Annotated[list[OilCelsius], Field(min_length=6, max_length=6)] | None = None  # noqa: N815
    """Temperatures of oil, outer ring, inner ring, rollers, housing and shaft at the start, instead of from_C. For example,
    use the temperatures of a result at another operating point."""
    from_point: dict[str, Any] | None = None
    """Keys of the scene with their values at another operating point, such as {"operation.inner_speed_rpm" = 800}, instead of
    from_C. The machine begins with the steady temperatures of that point."""
    schedule: StartSchedule | None = None
    """Speed and load over time. Default: the operating point from the start on."""
    housing_widths: Widths = 1.7
    """Length of housing that warms with the bearing, in widths of the bearing: 1 to 3. The heavier the housing, the longer the
    inner ring stays warmer than the outer one."""
    shaft_widths: Widths = 2.2
    """Length of shaft that warms with the bearing, in widths of the bearing: 1 to 5."""

    @property
    def widths(self) -> tuple[float, float]:
        """Widths of the bearing over which housing and shaft count."""
        return self.housing_widths, self.shaft_widths

    def temperatures(self, ambient: float) -> list[float]:
        """Temperatures of the parts at the start [C], with ``ambient`` around the machine."""
        return self.from_parts_C or [ambient if self.from_C is None else self.from_C] * 6

    def course(self, speed: float, load: float) -> "Course":
        """Speed [rad/s] and load [N] over time: those of the schedule, else ``speed`` and ``load`` of the operating point."""
        import numpy as np

        from rbdyn.thermal.start import Course

        times = [0.0] if self.schedule is None else self.schedule.time_s
        speeds, loads = (None, None) if self.schedule is None else (self.schedule.speed, self.schedule.load_N)
        speeds, loads = speeds or [speed] * len(times), loads or [load] * len(times)
        return Course(*(np.array(column, dtype=np.float64) for column in (times, speeds, loads)))


def start_faults(
    start: Start | None, lubricant: Lubricant, ambient: float, ceiling: float, reference_rpm: float | None
) -> Iterator[str]:
    """Contradictions of a start with the oil and the reference speed of a catalogue, if any.

    ``ambient``: temperature around the machine; ``ceiling``: of the oil [C].
    """
    if start is None:
        return
    stated = [f"thermal.start.{key}" for key in ORIGINS if getattr(start, key) is not None]
    if len(stated) > 1:
        yield f"{stated[0]} and {stated[1]} both state the temperatures at the start; leave one out"
    cold, name = (ambient, "thermal.ambient_C") if start.from_C is None else (start.from_C, "thermal.start.from_C")
    if start.from_parts_C is not None:
        cold, name = start.from_parts_C[0], "thermal.start.from_parts_C, oil"
    oil = lubricant.at(cold)
    thickness = 1e6 * oil.viscosity / oil.density
    if cold >= ceiling:
        yield f"{name} = {cold:g}: not below the ceiling of the oil, {ceiling:g} C (thermal.oil_ceiling_C); start colder"
    elif thickness > THICKEST:
        yield (
            f"{name} = {cold:g}: the oil has {thickness:.2g} mm2/s there, above the {THICKEST:g} of its law; start warmer or take a "
            "thinner oil"
        )
    fastest = max((start.schedule and start.schedule.speed_rpm) or [0.0])
    if reference_rpm is not None and fastest > MOST_OF_REFERENCE * reference_rpm:
        yield (
            f"thermal.start.schedule.speed_rpm: reaches {fastest:g}, above twice the reference speed of {reference_rpm:g} rpm; "
            "lower it or check its unit"
        )


def point_before(scene: "Scene") -> "Scene | None":
    """The scene at the operating point whose steady temperatures its machine has at the start; None without one. Raises InputError."""
    start = None if scene.thermal is None else scene.thermal.start
    if start is None or start.from_point is None:
        return None
    try:
        return scene.changed({"thermal.start": None, **start.from_point})
    except InputError as error:
        raise InputError([f"thermal.start.from_point: {fault}" for fault in error.faults]) from None


# Supplies whose oil stays in the bearing or leaves with air, so that the housing alone cools it.
COOLED_BY_HOUSING = ("bath", "drop", "oil_air", "grease")
# Keys of [mounting] that the balance computes.
PART_TEMPERATURES = tuple(
    f"{part}_temperature_C" for part in ("inner_ring", "outer_ring", "roller", "cage", "shaft", "housing")
)
# Key that is a first guess of the balance.
FIRST_GUESS = "lubricant.temperature_C"
RING_TEMPERATURES = "inner_ring_temperature_C", "outer_ring_temperature_C"
# Temperature at which ISO 15312 rates a bearing without a flow [C], and the usual rise of a flow of oil [K]: first guesses.
RATED_C, USUAL_RISE = 70.0, 20.0
# Customary ceilings of oils in service by base oil, and of cages by material [C], from memory of makers' catalogues.
OIL_CEILINGS = {"mineral": 120.0, "naphthenic": 120.0, "PAO": 150.0, "PAG": 150.0, "ester": 200.0}
CAGE_CEILINGS = {"peek": 150.0, "phenolic_cotton": 120.0}

NO_MOUNTING = (
    "[thermal]: needs [mounting] with bore, outside diameter and housing diameter, which decide what heat does; add it"
)


# One number for each of the four temperatures.
Slopes = Annotated[list[float], Field(min_length=4, max_length=4)]


class Near(Strict):
    """Heat balance of a similar roller bearing, from which the search begins: it takes less than half of the short runs. A study states
    that of the middle of its region for its design runs. Where it is far from this bearing, the search begins as without it.
    """

    temperatures_C: Annotated[list[OilCelsius], Field(min_length=4, max_length=4)]  # noqa: N815
    """Temperatures of oil, outer ring, inner ring and rollers, as a result has them."""
    slopes: Annotated[list[Slopes], Field(min_length=4, max_length=4)]
    """Change of each computed temperature by one kelvin more of each assumed one. Each row belongs to a computed temperature.
    A result has them as "slopes" under "thermal"."""


class Thermal(Sparse):
    """Heat balance of the bearing, which computes its temperatures: oil, outer ring with housing, inner ring with shaft, and
    rolling elements with cage have one temperature each.

    Needs [mounting], and lubricant.oil_flow_l_min or a lubricant.supply other than a jet. lubricant.temperature_C becomes the
    first guess and optional. The result has the temperatures, their errors and what the loop of heat and clearance does.
    """

    UNSAVED: ClassVar[Mapping[str, Any]] = {"start": None, "near": None}

    ambient_C: OilCelsius = 20.0  # noqa: N815
    """Temperature around housing and shaft; ISO 15312 has 20."""
    surface_factor: Positive = 1.0
    """Factor on the heat transfer from all surfaces in the bearing to the oil. The heat transfer is calculated as for a flat
    plate in pure oil. Formulas for the cavity of a bearing differ by a factor of ten: adjust it to one measured
    temperature."""
    housing_factor: NonNegative = 1.0
    """Factor on the heat that the housing removes, 0.016 W/mm2 of its seat at 50 K above ambient as in ISO 15312. A
    plummer block in moving air removes more, a hot housing nothing (0)."""
    shaft_factor: NonNegative = 0.5
    """Factor on the heat that the shaft removes, 0.016 W/mm2 of its seat at 50 K above ambient as in ISO 15312. Shafts have less
    surface than housings and remove 0.2 to 1 of that; a shaft as hot as the inner ring removes nothing (0)."""
    sump_factor: NonNegative = 1.0
    """Factor on the heat that bath oil loses through the housing walls: 150 W/m2K, based on the outer-ring seat. It counts
    with lubricant.supply = "bath" only."""
    film_share_to_oil: Annotated[float, Field(ge=0.0, le=1.0)] = 0.3
    """Share of the heat of films and rolling resistance that goes into the oil. Each surface gets half of the rest. Oil passes
    a contact in 1e-5 s, and heat is conducted to the walls in 1e-7 s, so little stays in the oil."""
    contact_factor: Positive = 1.0
    """Factor on the heat conducted through the raceway contacts, which follows from conductivity and heat capacity of the
    parts."""
    oil_share: Share = 1.0
    """Share of lubricant.oil_flow_l_min that enters the bearing. The outer ring of a 35 mm bearing with jets stayed within 12
    K of the temperature that the whole flow gives (NASA TP-2275)."""
    shaft_lag: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.125
    """Share of the inner ring's rise above ambient by which the shaft stays below the ring: 0.10 to 0.15 (NSK)."""
    cage_offset_K: Annotated[float, Field(ge=-100.0, le=100.0)] = 0.0  # noqa: N815
    """Temperature difference between cage and rolling elements."""
    oil_ceiling_C: OilCelsius | None = None  # noqa: N815
    """Highest temperature of the oil. Default by base oil: mineral 120, PAO and PAG 150, ester 200."""
    cage_ceiling_C: Annotated[float, Field(ge=-60.0, le=1000.0)] | None = None  # noqa: N815
    """Highest temperature of the cage. Default by material: PEEK 150, phenolic laminate 120, none for metals."""
    start: Start | None = None
    """Start of the cold machine: temperatures and clearances over time until they are steady; without it only the steady state."""
    near: Near | None = None
    """Heat balance of a similar bearing, from which the search begins. Default: a search from lubricant.temperature_C."""

    def ways_out(self, lubricant: Lubricant, oil: "Oil", mounting: Mounting, width: float) -> dict[str, float]:
        """Conductances to the oil stream and the surroundings by name [W/K], of a bearing with rings of a ``width`` [m]."""
        from rbdyn.thermal.network import oil_flow, seats, sump

        housing, shaft = seats(mounting.bore, mounting.outside_diameter, width)
        flow, bath = lubricant.oil_flow, lubricant.supply == "bath"
        return {
            "flow": 0.0 if flow is None else oil_flow(flow, oil, self.oil_share),
            "outer_ambient": self.housing_factor * housing,
            "inner_ambient": self.shaft_factor * shaft,
            "sump": self.sump_factor * sump(mounting.outside_diameter, width) if bath else 0.0,
        }


class Temperatures(NamedTuple):
    """Temperatures [C] of the oil in the cavity, outer ring, inner ring, and rolling elements."""

    oil: float
    outer: float
    inner: float
    rollers: float


class FilmTemperatures(NamedTuple):
    """Temperatures [C] of the oil in the cavity and in the films of outer race, inner race, pockets and guide land."""

    cavity: float
    outer: float
    inner: float
    pocket: float
    land: float


def film_temperatures(scene: "Scene", rings: "MountedRings | None") -> FilmTemperatures:
    """Temperatures of the oil where the scene's laws need it; ``rings``: as mounted, None for films at the oil's temperature.

    An inlet between two surfaces takes the mean of their temperatures by their speeds, which are equal in rolling.
    """
    oil, mounting = scene.lubricant.temperature_C, scene.mounting
    if mounting is None or rings is None:
        return FilmTemperatures(oil, oil, oil, oil, oil)
    reference = mounting.reference_temperature_C
    outer, inner = reference + rings.outer_ring.temperature_rise, reference + rings.inner_ring.temperature_rise
    rollers, cage = reference + rings.element_temperature_rise, given(scene.cage_temperature_C)
    guide = {"outer": outer, "inner": inner, "roller": rollers}[scene.cage.guidance]
    return FilmTemperatures(
        oil, 0.5 * (outer + rollers), 0.5 * (inner + rollers), 0.5 * (cage + rollers), 0.5 * (cage + guide)
    )


def over_ceiling(part: str, temperature: float, ceiling: float) -> str:
    """A sentence on the oil or the cage above its ceiling [C]; empty below."""
    sentence = f"the {part} reaches {temperature:.0f} C, above its ceiling of {ceiling:g} C (thermal.{part}_ceiling_C)"
    return sentence if temperature > ceiling else ""


def oil_ceiling(thermal: Thermal, lubricant: Lubricant) -> float:
    """Highest allowed temperature of the oil [C], stated or by its base oil."""
    return OIL_CEILINGS[lubricant.base_oil_name] if thermal.oil_ceiling_C is None else thermal.oil_ceiling_C


def ceilings(scene: "Scene") -> dict[str, float]:
    """Highest allowed temperature [C] of "oil" and "cage"; without an entry for a cage that endures any."""
    thermal = given(scene.thermal)
    oil = oil_ceiling(thermal, scene.lubricant)
    name = scene.materials.cage
    cage = thermal.cage_ceiling_C
    if cage is None and isinstance(name, str):
        cage = CAGE_CEILINGS.get(name)
    return {"oil": oil} | ({} if cage is None else {"cage": cage})


def too_hot(scene: "Scene", temperatures: Mapping[str, float]) -> str:
    """A sentence on the oil or the cage above its ceiling at temperatures of the nodes [C]; empty where both are below."""
    parts = {"oil": temperatures["oil"], "cage": temperatures["rollers"] + given(scene.thermal).cage_offset_K}
    excesses = (over_ceiling(part, parts[part], ceiling) for part, ceiling in ceilings(scene).items())
    return "; ".join(filter(None, excesses))


def turning_speed(speeds: tuple[float, float]) -> float:
    """Of inner and outer ring that of the inner one, or of the outer one where the inner ring stands still, without a sign [rad/s]."""
    return abs(speeds[0]) or abs(speeds[1])


def inlet_temperature(thermal: Thermal, lubricant: Lubricant) -> float:
    """Temperature of the oil before the bearing heats it [C]: that of its inlet, or ambient without a flow."""
    inlet = lubricant.oil_inlet_temperature_C
    return thermal.ambient_C if inlet is None or lubricant.oil_flow_l_min is None else inlet


def with_first_guess(tables: Mapping[str, Any]) -> Mapping[str, Any]:
    """Tables of a scene; with [thermal] and without lubricant.temperature_C, a first guess of it.

    A stated viscosity holds at a stated temperature, so no guess stands for that.
    """
    thermal, oil = tables.get("thermal"), tables.get("lubricant")
    if thermal is None or not isinstance(oil, Mapping) or {"temperature_C", "viscosity_mPas"} & set(oil):
        return tables
    inlet = oil.get("oil_inlet_temperature_C")
    flows = "oil_flow_l_min" in oil and isinstance(inlet, int | float)
    guess = min(inlet + USUAL_RISE, HOTTEST_C) if flows and isinstance(inlet, int | float) else RATED_C
    return {**tables, "lubricant": {**oil, "temperature_C": guess}}


def first_guess_faults(thermal: Thermal | None, lubricant: Lubricant | None, keys: Iterable[str]) -> list[str]:
    """A sentence if the ``keys`` that vary have the oil's temperature, which changes nothing where [thermal] computes it.

    A stated viscosity holds at that temperature, so it counts there.
    """
    computed = thermal is not None and lubricant is not None and lubricant.viscosity_mPas is None
    if not computed or FIRST_GUESS not in keys:
        return []
    return [
        f"{FIRST_GUESS}: is a first guess alone, since the heat balance of [thermal] computes it; vary thermal.ambient_C or "
        "lubricant.oil_inlet_temperature_C"
    ]


def thermal_faults(
    thermal: Thermal | None, lubricant: Lubricant, mounting: Mounting | None, designation: str | None
) -> Iterator[str]:
    """Contradictions of the heat balance with oil and mounting, one sentence each; a ``designation`` gives the width of rings."""
    flow, inlet = lubricant.oil_flow_l_min, lubricant.oil_inlet_temperature_C
    if inlet is not None and flow is None:
        yield (
            f"lubricant.oil_inlet_temperature_C = {inlet:g}: has no effect without lubricant.oil_flow_l_min; give the flow or leave "
            "it out"
        )
    if lubricant.film_temperature == "parts" and mounting is None:
        yield "lubricant.film_temperature = 'parts': needs the temperatures of [mounting]; add it or write 'oil'"
    if thermal is None:
        if lubricant.film_temperature == "parts" and mounting is not None:
            yield from _cold_films(mounting)
        return
    if mounting is None:
        yield NO_MOUNTING
    else:
        for key in PART_TEMPERATURES:
            if (value := getattr(mounting, key)) is not None:
                yield f"mounting.{key} = {value:g}: the heat balance of [thermal] computes it; leave out one of them"
        if mounting.width_mm is None and designation is None:
            yield "mounting.width_mm: missing; [thermal] needs the width of the rings where bearing.designation does not give it"
    if flow is None and lubricant.supply not in COOLED_BY_HOUSING:
        supply = f"with lubricant.supply = {lubricant.supply!r}" if lubricant.supply else "without lubricant.supply"
        yield (
            f"[thermal]: needs lubricant.oil_flow_l_min {supply}; give it, or a supply of {', '.join(COOLED_BY_HOUSING)}, whose oil "
            "the housing cools"
        )
    if flow is not None and inlet is None:
        yield "lubricant.oil_inlet_temperature_C: missing; [thermal] with lubricant.oil_flow_l_min needs it"
    bath = lubricant.supply == "bath" and thermal.sump_factor > 0.0
    if flow is None and not bath and thermal.housing_factor == thermal.shaft_factor == 0.0:
        yield (
            "thermal.housing_factor = 0 and thermal.shaft_factor = 0: leave the heat no way out of a bearing without "
            "lubricant.oil_flow_l_min; raise one of them"
        )
    start, name = inlet_temperature(thermal, lubricant), "lubricant.oil_inlet_temperature_C"
    if flow is None or inlet is None:
        name = "thermal.ambient_C"
    for key in ("oil_ceiling_C", "cage_ceiling_C"):
        ceiling = getattr(thermal, key)
        if ceiling is not None and ceiling <= start:
            yield f"thermal.{key} = {ceiling:g}: not above {name} = {start:g}; raise it or cool the oil"
    if thermal.oil_ceiling_C is None and start >= (usual := oil_ceiling(thermal, lubricant)):
        yield (
            f"{name} = {start:g}: not below {usual:g}, the usual ceiling of {lubricant.oil}; if {start:g} K are meant, write "
            f"{start - 273.15:.4g}, else cool the oil or state thermal.oil_ceiling_C"
        )


def _cold_films(mounting: Mounting) -> Iterator[str]:
    """The fault of films that follow rings without a stated temperature, which would have that of the drawing."""
    absent = [f"mounting.{key}" for key in RING_TEMPERATURES if getattr(mounting, key) is None]
    if absent:
        yield (
            f"lubricant.film_temperature = 'parts': needs {' and '.join(absent)}, or the films are as cold as the drawing; add "
            "these keys or write 'oil'"
        )


def part_temperatures(
    thermal: Thermal, temperatures: Temperatures, cage: bool = True, seats: tuple[Any, Any] | None = None
) -> dict[str, Any]:
    """Keys of [mounting] at temperatures of the nodes [C]; ``cage``: whether the bearing's model has one.

    ``seats``: temperatures of housing and shaft where these do not follow their rings at once. A shaft that warms from below
    ambient does not lag: the ring and the air heat it.
    """
    _, outer, inner, rollers = temperatures
    housing, shaft = (outer, inner) if seats is None else seats
    rise = shaft - thermal.ambient_C
    if seats is not None:
        rise = rise * ((rise >= 0.0) | (inner < shaft))
    parts = {
        "inner_ring_temperature_C": inner,
        "outer_ring_temperature_C": outer,
        "roller_temperature_C": rollers,
        "shaft_temperature_C": shaft - thermal.shaft_lag * rise,
        "housing_temperature_C": housing,
    }
    return parts | ({"cage_temperature_C": rollers + thermal.cage_offset_K} if cage else {})


def at_temperatures(scene: "Scene", temperatures: Temperatures, seats: tuple[float, float] | None = None) -> "Scene":
    """The scene with stated temperatures in place of its heat balance; its films have those of their surfaces.

    ``seats``: as of ``part_temperatures``. Raises InputError where it is impossible at these temperatures, such as a cage that seizes.
    """
    tables = deepcopy(scene._tables)
    del tables["thermal"]
    oil = temperatures.oil
    tables["lubricant"] |= {"temperature_C": oil, "film_temperature": "parts"}
    if scene.lubricant.viscosity_mPas is not None:
        tables["lubricant"]["viscosity_mPas"] = 1e3 * scene.lubricant.at(oil).viscosity
    tables["mounting"] |= part_temperatures(given(scene.thermal), temperatures, seats=seats)
    return scene.from_dict(tables, f"the bearing at {oil:.4g} C")


def begun_near(scene: "Scene", near: Near | None) -> "Scene":
    """The scene with a heat balance that begins from a similar one, if that and a balance are given."""
    if near is None or scene.thermal is None:
        return scene
    return scene.model_copy(update={"thermal": scene.thermal.model_copy(update={"near": near})})


def near_of(result: "SimulationResult") -> Near | None:
    """The heat balance of a result for that of a similar bearing, to digits that other processors give too; None without slopes."""
    if result.temperatures_C is None or result.thermal is None or result.thermal.slopes is None:
        return None
    nodes = [round(result.temperatures_C[node].value, 1) for node in Temperatures._fields]
    slopes = [[round(slope, 2) + 0.0 for slope in row] for row in result.thermal.slopes]
    return Near(temperatures_C=nodes, slopes=slopes)


def simulated_scene(result: "SimulationResult", source: str = "scene") -> "Scene":
    """The scene that a result ran, with [thermal] at the temperatures of its last state; messages name the ``source``."""
    from rbdyn.scene import Scene

    scene = Scene.from_dict(result.scene, source)
    if result.thermal is None:
        return scene
    return at_temperatures(scene, Temperatures(**result.thermal.path_C[-1]))
