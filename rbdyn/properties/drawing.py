"""Estimates of what one's own drawing of a bearing leaves open: bore, outside diameter and width, the effective length of rollers.

They are the rules of ``catalogue`` the other way round, from what is inside to the outside. Of rollers D_w = 0.547 (D - d)/2, and the
pitch diameter is 1.01 (d + D)/2; of balls D_w = 0.30 (D - d), and it is (d + D)/2.

46 sizes of ``cylindrical_rollers.csv`` list both raceways (series 2 and 3). Nine in ten of their bores and outside diameters come
within 0.08 roller diameters, and within 0.04 where the other one is stated. Nine in ten of their rings are 0.4 to 0.8 roller
diameters wider than the roller, 0.54 in the median.
"""

from typing import NamedTuple

from rbdyn.properties.catalogue import PITCH_SHARE, ROLLER_SHARE, BallInterior, Envelope, RollerInterior

STATED = "stated"
# Both ends of a roller that carry no load, in its diameters; of a short roller the largest share of its length.
ROUNDED_ENDS, LARGEST_ROUNDED_SHARE = 0.1, 0.2
# Ring wider than its rollers, in their diameters.
RING_WIDER = 0.54
# Roller over width of the ring, of the longest rollers in it.
LONG_SHARE = 0.8
# Ball diameter over D - d: 0.27 to 0.32 by series. Width over ball diameter: 1.4 to 2.0 of nine in ten of 105 listed sizes.
BALL_SHARE, BALL_WIDTH = 0.30, 1.7
# What a ring has at least between its raceway and its bore or outside, in rolling element diameters.
THINNEST_RING, THIN_RING = 0.1, 0.2
# The bore of what is left of an inner ring by few large rollers, over its raceway.
THICK_RING_BORE = 0.5
# Decimals of an estimated boundary dimension [mm].
DECIMALS = 1


class RollerDrawing(NamedTuple):
    """Rollers of a drawing: number, diameter, whole length, diameter of the circle through their centres [mm]."""

    rollers: int
    diameter: float
    length: float
    pitch_diameter: float


class BallDrawing(NamedTuple):
    """Balls of a drawing: number, diameter, pitch diameter [mm], contact angle [deg], which is None of a bearing with a clearance."""

    balls: int
    diameter: float
    pitch_diameter: float
    contact_angle: float | None


class Boundary(NamedTuple):
    """Boundary dimensions [mm] of a drawing, stated or estimated, and where each comes from."""

    bore: float
    outside: float
    width: float
    bore_by: str
    outside_by: str
    width_by: str

    @property
    def envelope(self) -> Envelope:
        """The same without sources."""
        return Envelope(self.bore, self.outside, self.width)


class Estimate(NamedTuple):
    """A size [mm] and the rule that gives it, with its error."""

    size: float
    rule: str

    @property
    def rounded(self) -> "Estimate":
        """The same in tenths of a millimetre."""
        return Estimate(round(self.size, DECIMALS), self.rule)


def roller_boundary(drawing: RollerDrawing, bore: float | None, outside: float | None, width: float | None) -> Boundary:
    """Boundary dimensions of a roller bearing [mm]; None: to be estimated."""
    mean, height = drawing.pitch_diameter / PITCH_SHARE, drawing.diameter / ROLLER_SHARE
    circle, error = f"pitch diameter/{PITCH_SHARE:g}", "roller diameters"
    bores = [Estimate(mean - height, f"estimated: {circle} - roller/{ROLLER_SHARE:g}, +-0.08 {error}")]
    outsides = [Estimate(mean + height, f"estimated: {circle} + roller/{ROLLER_SHARE:g}, +-0.08 {error}")]
    if outside is not None:
        bores = [
            Estimate(2.0 * mean - outside, f"estimated: twice {circle} less the outside diameter, +-0.04 {error}"),
            *bores,
        ]
    if bore is not None:
        outsides = [Estimate(2.0 * mean - bore, f"estimated: twice {circle} less the bore, +-0.04 {error}"), *outsides]
    along = max(
        Estimate(
            drawing.length + RING_WIDER * drawing.diameter,
            f"estimated: roller + {RING_WIDER:g} {error}; 0.4 to 0.8 are usual",
        ),
        Estimate(drawing.length / LONG_SHARE, f"estimated: roller/{LONG_SHARE:g}, as of the longest rollers, +-10 %"),
    )
    rings = _bore(drawing, bore, bores), _outside(drawing, outside, outsides)
    return _boundary(*rings, along.rounded if width is None else Estimate(width, STATED))


def ball_boundary(drawing: BallDrawing, bore: float | None, outside: float | None, width: float | None) -> Boundary:
    """Boundary dimensions of a ball bearing [mm]; None: to be estimated."""
    pitch, half = drawing.pitch_diameter, 0.5 * drawing.diameter / BALL_SHARE
    rule = f"ball/{2.0 * BALL_SHARE:g}, +-0.17 ball diameters"
    bores = [Estimate(pitch - half, f"estimated: pitch diameter - {rule}")]
    outsides = [Estimate(pitch + half, f"estimated: pitch diameter + {rule}")]
    twice = "estimated: twice the pitch diameter less the"
    if outside is not None:
        bores = [Estimate(2.0 * pitch - outside, f"{twice} outside diameter, +-2 %"), *bores]
    if bore is not None:
        outsides = [Estimate(2.0 * pitch - bore, f"{twice} bore, +-2 %"), *outsides]
    rings = _bore(drawing, bore, bores), _outside(drawing, outside, outsides)
    along = Estimate(BALL_WIDTH * drawing.diameter, f"estimated: {BALL_WIDTH:g} ball diameters; 1.4 to 2.0 are usual")
    return _boundary(*rings, along.rounded if width is None else Estimate(width, STATED))


def _boundary(bore: Estimate, outside: Estimate, width: Estimate) -> Boundary:
    return Boundary(bore.size, outside.size, width.size, bore.rule, outside.rule, width.rule)


def _bore(drawing: RollerDrawing | BallDrawing, size: float | None, estimates: list[Estimate]) -> Estimate:
    """The stated bore, else the first estimate that leaves an inner ring, else one of a ring far from usual ones."""
    if size is not None:
        return Estimate(size, STATED)
    raceway = drawing.pitch_diameter - drawing.diameter
    least, most = THICK_RING_BORE * raceway, raceway - 2.0 * THINNEST_RING * drawing.diameter
    thick = Estimate(least, f"estimated: {THICK_RING_BORE:g} of the inner raceway, because no usual ring fits")
    return next((estimate for estimate in estimates if least < estimate.size < most), thick).rounded


def _outside(drawing: RollerDrawing | BallDrawing, size: float | None, estimates: list[Estimate]) -> Estimate:
    """The stated outside diameter, else the first estimate that leaves an outer ring, else that of a thin ring."""
    if size is not None:
        return Estimate(size, STATED)
    raceway = drawing.pitch_diameter + drawing.diameter
    thin = f"estimated: a ring of {THIN_RING:g} rolling element diameters, because no usual ring fits"
    fitting = (estimate for estimate in estimates if estimate.size > raceway + 2.0 * THINNEST_RING * drawing.diameter)
    return next(fitting, Estimate(raceway + 2.0 * THIN_RING * drawing.diameter, thin)).rounded


def drawing_roller_interior(drawing: RollerDrawing) -> RollerInterior:
    """Interior of a roller bearing of one's own: as drawn, its effective length estimated as of a catalogue bearing."""
    usual, most = ROUNDED_ENDS * drawing.diameter, LARGEST_ROUNDED_SHARE * drawing.length
    ends, rule = (
        (usual, f"{0.5 * ROUNDED_ENDS:g} diameters")
        if usual <= most
        else (most, f"{0.5 * LARGEST_ROUNDED_SHARE:g} of the length")
    )
    return RollerInterior(
        rollers=drawing.rollers,
        roller_diameter=drawing.diameter,
        pitch_diameter=drawing.pitch_diameter,
        effective_length=round(drawing.length - ends, 3),
        roller_length=drawing.length,
        roller_diameter_by=STATED,
        pitch_diameter_by=STATED,
        effective_length_by=f"estimated: chamfers of {0.5 * ends:.3g} mm, {rule}, take both ends; +-5 %",
        rollers_by=STATED,
        roller_length_by=STATED,
        bar_width_by="width between the pockets at the pitch circle, as exact as their clearance",
    )


def drawing_ball_interior(drawing: BallDrawing) -> BallInterior:
    """Interior of a ball bearing of one's own, all of it drawn."""
    sizes = drawing.balls, drawing.diameter, drawing.pitch_diameter, drawing.contact_angle
    return BallInterior(*sizes, STATED, STATED, STATED, STATED)
