"""Form errors of a ball bearing: grooves and balls as measured, or drawn by a seed."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from rbdyn.base.words import counted
from rbdyn.faults import Consistent, Strict
from rbdyn.fields import SI, NonNegative, NotVanishing, OptionalSI
from rbdyn.scene.bearing import Harmonic

if TYPE_CHECKING:
    from rbdyn.arrays import Array

Order = Annotated[int, Field(ge=1, le=2000)]
# Beyond this share of the ball it is no form error but a slip of the unit.
LARGEST_ERROR = 0.01


class RandomWaviness(Strict):
    """Waves in random phases, ``lowest_order`` to ``highest_order``."""

    lowest_order: Order = 1
    """Lowest order of the waves drawn."""
    highest_order: Order
    """Highest order of the waves drawn."""
    height_um: Annotated[float, Field(gt=0.0, le=500.0), NotVanishing]
    """Height from peak to valley of all waves together."""
    decay: Annotated[float, Field(ge=0.0, le=10.0)] = 1.0
    """Amplitudes fall as order^-decay on the average; ground raceways: between 1 and 2."""
    height = SI("um")


class BallHarmonic(Strict):
    """One harmonic of the sphericity of balls, from order 2: order 1 is no form."""

    order: Annotated[int, Field(ge=2, le=2000)]
    """Waves around a ball, from 2: order 1 is no form."""
    amplitude_um: Annotated[float, Field(ge=-500.0, le=500.0)]
    """Amplitude of the ball's radius."""
    phase_deg: float | None = None
    """Angle of a crest; drawn for each ball by errors.seed where left out."""
    balls: list[Annotated[int, Field(ge=1)]] | None = None
    """Numbers of the balls that have it, from 1; every ball where left out."""
    amplitude, phase = SI("um"), OptionalSI("deg")


class FormErrors(Consistent):
    """Form errors of grooves and balls, and how finely and how long the turning ring is followed.

    Each error of a groove is given by its harmonics, drawn at random, or both added.
    """

    inner_roundness: list[Harmonic] = []
    """Radial harmonics of the inner groove."""
    outer_roundness: list[Harmonic] = []
    """Radial harmonics of the outer groove."""
    inner_side_sway: list[Harmonic] = []
    """Axial harmonics of the inner groove: order 1 is side-sway proper, others axial waviness."""
    outer_side_sway: list[Harmonic] = []
    """Axial harmonics of the outer groove: order 1 is side-sway proper, others axial waviness."""
    inner_groove_radius: list[Harmonic] = []
    """Harmonics of the inner groove's radius, the width of the groove at a fixed bottom."""
    outer_groove_radius: list[Harmonic] = []
    """Harmonics of the outer groove's radius, the width of the groove at a fixed bottom."""
    inner_roundness_random: RandomWaviness | None = None
    """Radial waves of the inner groove drawn by errors.seed, on top of the given ones."""
    outer_roundness_random: RandomWaviness | None = None
    """Radial waves of the outer groove drawn by errors.seed, on top of the given ones."""
    inner_side_sway_random: RandomWaviness | None = None
    """Axial waves of the inner groove drawn by errors.seed, on top of the given ones."""
    outer_side_sway_random: RandomWaviness | None = None
    """Axial waves of the outer groove drawn by errors.seed, on top of the given ones."""
    inner_groove_radius_random: RandomWaviness | None = None
    """Waves of the inner groove's radius drawn by errors.seed, on top of the given ones."""
    outer_groove_radius_random: RandomWaviness | None = None
    """Waves of the outer groove's radius drawn by errors.seed, on top of the given ones."""
    ball_sphericity: list[BallHarmonic] = []
    """Harmonics of the balls' radius."""
    ball_diameter_errors_um: list[float] | None = None
    """Each ball's diameter less the nominal one, instead of ball_diameter_spread_um."""
    ball_diameter_spread_um: NonNegative = 0.0
    """Standard deviation of a seeded normal spread of the balls' diameters."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of all that is drawn."""
    steps: Annotated[int, Field(ge=8, le=100_000)] = 360
    """Steps to a turn of the inner ring against the outer."""
    turns: Annotated[int, Field(ge=1, le=10_000)] = 8
    """Turns of the inner ring that are followed, since the cage does not come round with the ring."""

    def faults(self) -> Iterator[str]:
        for key in GROOVES:
            drawn = getattr(self, f"{key}_random")
            if drawn is not None and drawn.lowest_order > drawn.highest_order:
                what = f"errors.{key}_random.lowest_order = {drawn.lowest_order}"
                yield f"{what}: above highest_order = {drawn.highest_order}; swap them"
        if self.ball_diameter_errors_um is not None and self.ball_diameter_spread_um > 0.0:
            what = "errors.ball_diameter_errors_um and errors.ball_diameter_spread_um contradict each other"
            yield f"{what}: give the errors or their spread, not both"
        highest = self.highest_order
        if 2 * highest >= self.steps:
            what = f"errors.steps = {self.steps}: too few to show order {highest}"
            yield f"{what}, which needs more than two steps a wave; take at least {2 * highest + 1}"

    def ball_diameter_errors(self, normal: "Array") -> "Array":
        """Each ball's diameter less the nominal one [m], as given or with the spread of standard ``normal`` numbers."""
        import numpy as np

        given, spread = self.ball_diameter_errors_um, self.ball_diameter_spread_um
        return 1e-6 * (spread * normal if given is None else np.array(given))

    @property
    def highest_order(self) -> int:
        """Highest order of a groove; 0 where all are perfect."""
        given = [wave.order for key in GROOVES for wave in getattr(self, key)]
        drawn = [getattr(self, f"{key}_random") for key in GROOVES]
        return max(given + [wave.highest_order for wave in drawn if wave is not None], default=0)


GROOVES = tuple(key for key in FormErrors.model_fields if f"{key}_random" in FormErrors.model_fields)


def misfits(errors: FormErrors, balls: int, ball_diameter_mm: float, pitch_diameter_mm: float) -> Iterator[str]:
    """What does not go with a row of ``balls`` on a pitch circle, one sentence each."""
    given = errors.ball_diameter_errors_um
    if given is not None and len(given) != balls:
        yield f"errors.ball_diameter_errors_um: {counted(len(given), 'value')} for {balls} balls; give one a ball"
    limit = LARGEST_ERROR * ball_diameter_mm * 1e3
    if any(abs(error) > limit for error in given or []) or errors.ball_diameter_spread_um > limit:
        yield f"errors: ball diameters beyond {limit:g} um, a hundredth of the ball; give micrometres"
    for number, harmonic in enumerate(errors.ball_sphericity, 1):
        alien = [ball for ball in harmonic.balls or [] if ball > balls]
        if alien:
            yield f"errors.ball_sphericity[{number}].balls: ball {alien[0]} of {balls}; balls count from 1 to {balls}"
    # A ball spins dm/(2 D) times a turn, or a little less.
    fastest = max((wave.order for wave in errors.ball_sphericity), default=0) * pitch_diameter_mm / ball_diameter_mm
    if fastest >= errors.steps:
        spinning = f"balls that spin {0.5 * pitch_diameter_mm / ball_diameter_mm:.3g} times a turn"
        what = f"errors.steps = {errors.steps}: too few to show errors.ball_sphericity on {spinning}"
        yield f"{what}; take at least {int(fastest) + 1}"
