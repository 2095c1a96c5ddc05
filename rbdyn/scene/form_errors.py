"""Form errors of grooves and balls, and the contradictions of these errors with a row of balls."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from rbdyn.base.faults import SI, Consistent, NonNegative, NotVanishing, OptionalSI, Strict
from rbdyn.base.words import counted
from rbdyn.scene.bearing import Harmonic

if TYPE_CHECKING:
    from rbdyn.base.arrays import Array

Order = Annotated[int, Field(ge=1, le=2000)]
# Largest plausible form error as a share of the ball diameter.
LARGEST_ERROR = 0.01


class RandomWaviness(Strict):
    """Waves of random phase from ``lowest_order`` to ``highest_order``."""

    lowest_order: Order = 1
    """Lowest order of the random waves."""
    highest_order: Order
    """Highest order of the random waves."""
    height_um: Annotated[float, Field(gt=0.0, le=500.0), NotVanishing]
    """Peak-to-valley height of the sum of all waves."""
    decay: Annotated[float, Field(ge=0.0, le=10.0)] = 1.0
    """Exponent of the mean amplitude, order^-decay: between 1 and 2 for ground raceways."""
    height = SI("um")


class BallHarmonic(Strict):
    """One harmonic of the sphericity of balls."""

    order: Annotated[int, Field(ge=2, le=2000)]
    """Waves around a ball, from 2, since order 1 is a shift."""
    amplitude_um: Annotated[float, Field(ge=-500.0, le=500.0)]
    """Amplitude of the ball's radius."""
    phase_deg: float | None = None
    """Angle of a crest. Default: random for each ball, by errors.seed."""
    balls: list[Annotated[int, Field(ge=1)]] | None = None
    """Numbers of the balls with this harmonic, from 1. Default: all."""
    amplitude, phase = SI("um"), OptionalSI("deg")


class FormErrors(Consistent):
    """Form errors of grooves and balls, and the steps and turns over which runout is computed.

    The errors of a groove are stated as harmonics, drawn at random, or the sum of both.
    """

    inner_roundness: list[Harmonic] = []
    """Radial harmonics of the inner groove."""
    outer_roundness: list[Harmonic] = []
    """Radial harmonics of the outer groove."""
    inner_side_sway: list[Harmonic] = []
    """Axial harmonics of the inner groove: order 1 is side sway, others are axial waviness."""
    outer_side_sway: list[Harmonic] = []
    """Axial harmonics of the outer groove: order 1 is side sway, others are axial waviness."""
    inner_groove_radius: list[Harmonic] = []
    """Harmonics of the inner groove's radius, the width of the groove at a fixed bottom."""
    outer_groove_radius: list[Harmonic] = []
    """Harmonics of the outer groove's radius, the width of the groove at a fixed bottom."""
    inner_roundness_random: RandomWaviness | None = None
    """Random radial waves of the inner groove by errors.seed, in addition to the stated ones."""
    outer_roundness_random: RandomWaviness | None = None
    """Random radial waves of the outer groove by errors.seed, in addition to the stated ones."""
    inner_side_sway_random: RandomWaviness | None = None
    """Random axial waves of the inner groove by errors.seed, in addition to the stated ones."""
    outer_side_sway_random: RandomWaviness | None = None
    """Random axial waves of the outer groove by errors.seed, in addition to the stated ones."""
    inner_groove_radius_random: RandomWaviness | None = None
    """Random waves of the inner groove's radius by errors.seed, in addition to the stated ones."""
    outer_groove_radius_random: RandomWaviness | None = None
    """Random waves of the outer groove's radius by errors.seed, in addition to the stated ones."""
    ball_sphericity: list[BallHarmonic] = []
    """Harmonics of the balls' radius."""
    ball_diameter_errors_um: list[float] | None = None
    """Deviation of each ball's diameter from the nominal one, instead of ball_diameter_spread_um."""
    ball_diameter_spread_um: NonNegative = 0.0
    """Standard deviation of the balls' diameters, drawn from a normal distribution by errors.seed."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of all random form errors."""
    steps: Annotated[int, Field(ge=8, le=100_000)] = 360
    """Steps in a turn of the inner ring against the outer ring."""
    turns: Annotated[int, Field(ge=1, le=10_000)] = 8
    """Turns of the inner ring over which runout is computed; the cage does not return to its place after one."""

    def faults(self) -> Iterator[str]:
        for key in GROOVES:
            waves = getattr(self, f"{key}_random")
            if waves is not None and waves.lowest_order > waves.highest_order:
                yield (
                    f"errors.{key}_random.lowest_order = {waves.lowest_order}: above highest_order = {waves.highest_order}; "
                    "swap them"
                )
        if self.ball_diameter_errors_um is not None and self.ball_diameter_spread_um > 0.0:
            yield (
                "errors.ball_diameter_errors_um and errors.ball_diameter_spread_um contradict each other: "
                "give the errors or their spread, not both"
            )
        highest = self.highest_order
        if 2 * highest >= self.steps:
            yield (
                f"errors.steps = {self.steps}: too few to show order {highest}, which needs more than two steps a wave; "
                f"take at least {2 * highest + 1}"
            )

    def ball_diameter_errors(self, normal: "Array") -> "Array":
        """Deviation of each ball's diameter [m], stated or the spread times standard ``normal`` numbers."""
        import numpy as np

        errors, spread = self.ball_diameter_errors_um, self.ball_diameter_spread_um
        return 1e-6 * (spread * normal if errors is None else np.array(errors))

    @property
    def highest_order(self) -> int:
        """Highest order of a groove; 0 for perfect grooves."""
        orders = [wave.order for key in GROOVES for wave in getattr(self, key)]
        random_waves = [getattr(self, f"{key}_random") for key in GROOVES]
        return max(orders + [waves.highest_order for waves in random_waves if waves is not None], default=0)


GROOVES = tuple(key for key in FormErrors.model_fields if f"{key}_random" in FormErrors.model_fields)


def misfits(errors: FormErrors, balls: int, ball_diameter_mm: float, pitch_diameter_mm: float) -> Iterator[str]:
    """One sentence for each contradiction of the form errors and a row of ``balls``."""
    values = errors.ball_diameter_errors_um
    if values is not None and len(values) != balls:
        yield (
            f"errors.ball_diameter_errors_um: {counted(len(values), 'value')} for {balls} balls; give one value for each ball"
        )
    limit = LARGEST_ERROR * ball_diameter_mm * 1e3
    if any(abs(error) > limit for error in values or []) or errors.ball_diameter_spread_um > limit:
        yield f"errors: ball diameters beyond {limit:g} um, a hundredth of the ball; give micrometres"
    for number, harmonic in enumerate(errors.ball_sphericity, 1):
        alien = [ball for ball in harmonic.balls or [] if ball > balls]
        if alien:
            yield f"errors.ball_sphericity[{number}].balls: ball {alien[0]} of {balls}; balls count from 1 to {balls}"
    # A ball spins up to dm/(2 D) times a turn.
    fastest = max((wave.order for wave in errors.ball_sphericity), default=0) * pitch_diameter_mm / ball_diameter_mm
    if fastest >= errors.steps:
        yield (
            f"errors.steps = {errors.steps}: too few to show errors.ball_sphericity on balls that spin "
            f"{0.5 * pitch_diameter_mm / ball_diameter_mm:.3g} times a turn; take at least {int(fastest) + 1}"
        )
