"""Columns of a rig's table, and the tables of a scene that a calibration reads, as ``doe keys`` lists them.

A row of the table is an operating condition. Further columns are named by keys of the scene, such as operation.inner_speed_rpm.
"""

from typing import Annotated, Literal

from pydantic import Field

from rbdyn.base.faults import Strict
from rbdyn.scene.uncertain import Calibrate, Uncertain

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Percent = Annotated[float, Field(ge=0.0, le=100.0)]


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
    """Measured whirl deviation ratio of the cage's centre."""
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
    """Measured mean speed of the cage."""
    cage_speed_rpm_sd: Positive | None = None
    """Standard deviation of the measured cage speed; or give turns."""
    cage_speed_rpm_accuracy_percent: Percent | None = None
    """Accuracy of the sensor of the cage speed: standard deviation of one offset of all rows, 0.1 unless stated."""
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
