"""Fatigue life: ``rollers`` and ``balls`` (ISO/TS 16281, Lundberg and Palmgren), ``roller_capacity`` and ``ball_capacity`` (ISO
281 and ISO 76 from dimensions; makers' rules against skidding), ``turns`` (life as time)."""
