"""Columns of a rig's table and of its signal files, and the tables of a scene that a calibration reads, as ``doe keys`` lists them.

A row of the table is an operating condition. Further columns are named by keys of the scene, such as operation.inner_speed_rpm.
"""

from typing import Annotated, Literal

from pydantic import Field

from rbdyn.base.faults import Strict
from rbdyn.scene.uncertain import Calibrate, Uncertain

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Percent = Annotated[float, Field(ge=0.0, le=100.0)]
Kind = Literal["cage_pulses", "cage_speed", "orbit", "impact_force", "impact_acceleration", "impact_pulses"]


class SceneTables(Strict):
    """Tables of a scene for doe uncertainty and doe calibrate; all other tables are described by rbdyn keys."""

    uncertain: Uncertain | None = None
    """Unknown inputs of the scene, with laws or documented ranges: doe uncertainty varies them, doe calibrate estimates them."""
    calibrate: Calibrate | None = None
    """Settings of doe calibrate, which estimates the unknown inputs; no run depends on them."""


class RigTable(Strict):
    """Columns of RIG.csv next to those named by keys of the scene.

    Of each output NAME_sd is the scatter of the single row, and NAME_accuracy_percent the offset that all rows share."""

    impact_force_N: Positive | None = None  # noqa: N815
    """Measured largest force between a roller and the cage, mean over windows of shaft turns."""
    impact_force_N_sd: Positive | None = None  # noqa: N815
    """Standard deviation of the measured impact force; or give turns."""
    impact_force_N_accuracy_percent: Percent | None = None  # noqa: N815
    """Accuracy of the sensor of the impact force: standard deviation of one offset of all rows, 10 unless stated."""
    impact_contact_force_N: Positive | None = None  # noqa: N815
    """Measured impact force by contact alone, without the oil film of the pocket."""
    impact_contact_force_N_sd: Positive | None = None  # noqa: N815
    """Standard deviation of the measured impact force by contact; or give turns."""
    impact_contact_force_N_accuracy_percent: Percent | None = None  # noqa: N815
    """Accuracy of the sensor of the impact contact force: standard deviation of one offset of all rows, 10 unless stated."""
    whirl_deviation_ratio: Positive | None = None
    """Measured whirl deviation ratio of the cage's centre; an orbit as signal gives it too."""
    whirl_deviation_ratio_sd: Positive | None = None
    """Standard deviation of the measured whirl deviation ratio; or give turns."""
    whirl_deviation_ratio_accuracy_percent: Percent | None = None
    """Accuracy of the sensor of the whirl deviation ratio: standard deviation of one offset of all rows, 5 unless stated."""
    power_loss_W: Positive | None = None  # noqa: N815
    """Measured power loss of the bearing."""
    power_loss_W_sd: Positive | None = None  # noqa: N815
    """Standard deviation of the measured power loss; or give turns."""
    power_loss_W_accuracy_percent: Percent | None = None  # noqa: N815
    """Accuracy of the sensor of the power loss: standard deviation of one offset of all rows, 3 unless stated."""
    cage_speed_rpm: Positive | None = None
    """Measured mean speed of the cage; pulses or samples of a signal give it too."""
    cage_speed_rpm_sd: Positive | None = None
    """Standard deviation of the measured cage speed; or give turns."""
    cage_speed_rpm_accuracy_percent: Percent | None = None
    """Accuracy of the sensor of the cage speed: standard deviation of one offset of all rows, 0.1 unless stated."""
    pulse_rate_hz: Positive | None = None
    """Measured impact pulses in a second at one pocket; a signal gives them too."""
    pulse_rate_hz_sd: Positive | None = None
    """Standard deviation of the measured pulse rate; or give turns."""
    pulse_rate_hz_accuracy_percent: Percent | None = None
    """Accuracy of the sensor of the pulse rate: standard deviation of one offset of all rows, 10 unless stated."""
    pulse_height_N: Positive | None = None  # noqa: N815
    """Measured mean of the largest forces of the pulses; a signal gives it too."""
    pulse_height_N_sd: Positive | None = None  # noqa: N815
    """Standard deviation of the measured pulse height; or give turns."""
    pulse_height_N_accuracy_percent: Percent | None = None  # noqa: N815
    """Accuracy of the sensor of the pulse height: standard deviation of one offset of all rows, 10 unless stated."""
    pulse_impulse_N_s: Positive | None = None  # noqa: N815
    """Measured mean integral of the force over a pulse; a trace of force or acceleration gives it too."""
    pulse_impulse_N_s_sd: Positive | None = None  # noqa: N815
    """Standard deviation of the measured impulse; or give turns."""
    pulse_impulse_N_s_accuracy_percent: Percent | None = None  # noqa: N815
    """Accuracy of the sensor of the pulse impulse: standard deviation of one offset of all rows, 10 unless stated."""
    oil_temperature_C: Positive | None = None  # noqa: N815
    """Measured temperature of the oil that leaves the bearing, of a scene with [thermal]."""
    oil_temperature_C_sd: Positive | None = None  # noqa: N815
    """Standard deviation of the measured temperature of the oil; turns do not replace it."""
    oil_temperature_C_accuracy_percent: Percent | None = None  # noqa: N815
    """Accuracy of the sensor of the oil temperature: standard deviation of one offset of all rows, 1.5 unless stated."""
    outer_temperature_C: Positive | None = None  # noqa: N815
    """Measured temperature of the outer ring, of a scene with [thermal]."""
    outer_temperature_C_sd: Positive | None = None  # noqa: N815
    """Standard deviation of the measured temperature of the outer ring; turns do not replace it."""
    outer_temperature_C_accuracy_percent: Percent | None = None  # noqa: N815
    """Accuracy of the sensor of the outer temperature: standard deviation of one offset of all rows, 1.5 unless stated."""
    inner_temperature_C: Positive | None = None  # noqa: N815
    """Measured temperature of the inner ring, of a scene with [thermal]."""
    inner_temperature_C_sd: Positive | None = None  # noqa: N815
    """Standard deviation of the measured temperature of the inner ring; turns do not replace it."""
    inner_temperature_C_accuracy_percent: Percent | None = None  # noqa: N815
    """Accuracy of the sensor of the inner temperature: standard deviation of one offset of all rows, 1.5 unless stated."""
    roller_temperature_C: Positive | None = None  # noqa: N815
    """Measured temperature of the rollers, of a scene with [thermal]."""
    roller_temperature_C_sd: Positive | None = None  # noqa: N815
    """Standard deviation of the measured temperature of the rollers; turns do not replace it."""
    roller_temperature_C_accuracy_percent: Percent | None = None  # noqa: N815
    """Accuracy of the sensor of the roller temperature: standard deviation of one offset of all rows, 1.5 unless stated."""
    turns: Positive | None = None
    """Shaft turns of the measurement: its scatter is that of a run as long, where no standard deviation is stated."""
    hold: Literal["1", "yes", "true", "0", "no", "false"] | None = None
    """Whether the row is held out of the calibration to test it: 1 for a row that is held out, else 0."""
    signal_file: str | None = None
    """Raw samples in place of measured values: a CSV file, named relative to the folder of the table."""
    signal_kind: Kind | None = None
    """What the signal file holds; its columns are those of this kind."""
    pulses_per_turn: Annotated[int, Field(ge=1, le=10**6)] | None = None
    """Pulses in a turn of the cage, of a signal of cage_pulses; 1 where it is left out."""
    cutoff_hz: Positive | None = None
    """Frequency below which an orbit counts; the simulated whirl of this row has the same filter."""
    still_file: str | None = None
    """Record of the rig at rest: its noise is taken off the whirl of an orbit. Columns as of the orbit."""
    threshold_N: NotNegative | None = None  # noqa: N815
    """Force above which a stretch of the trace, of either sign, is an impact pulse."""
    bandwidth_hz: Positive | None = None
    """Gaussian low pass before that; choose it below what the sensor and its amplifier pass."""
    dead_time_ms: NotNegative | None = None
    """Time after a pulse in which further ones belong to it; 0 where it is left out."""
    sensor_mass_g: Positive | None = None
    """Force over acceleration, from a tap with a hammer, of a signal of impact_acceleration."""


class SignalFile(Strict):
    """Columns of a signal file; each kind of signal has those that name it."""

    t_s: float
    """Time of a sample or pulse of any kind of signal; rising, at equal intervals for orbits, forces and accelerations."""
    cage_speed_rpm: float | None = None
    """Speed of the cage at that time, of a signal of cage_speed."""
    x_um: float | None = None
    """Place of the cage's centre along the load, of an orbit; or x_m."""
    y_um: float | None = None
    """Place of the cage's centre 90 degrees ahead of the load, of an orbit; or y_m."""
    x_m: float | None = None
    """Place of the cage's centre along the load, of an orbit; or x_um."""
    y_m: float | None = None
    """Place of the cage's centre 90 degrees ahead of the load, of an orbit; or y_um."""
    force_N: float | None = None  # noqa: N815
    """Force between a roller and the walls of one pocket, of a signal of impact_force; or force_kN."""
    force_kN: float | None = None  # noqa: N815
    """Force in kilonewtons between a roller and the walls of one pocket, of a signal of impact_force; or force_N."""
    acceleration_m_s2: float | None = None
    """Acceleration of the sensor, of a signal of impact_acceleration."""
    height_N: float | None = None  # noqa: N815
    """Largest force of a pulse that a logger took, of a signal of impact_pulses; or height_kN."""
    height_kN: float | None = None  # noqa: N815
    """Largest force in kilonewtons of a pulse that a logger took, of a signal of impact_pulses; or height_N."""
