"""Names of the figures of parts of a bearing. They stand apart so that a command can check a name without compiled code."""

from rbdyn.losses import POWER_TERMS

POWERS = {f"{loss}_power_W": loss for loss in POWER_TERMS}
# Operating diametral clearances, and the clearance of the scene that each is.
CLEARANCES = {f"{name}_operating_clearance_um": name for name in ("radial", "guide", "pocket")}
# Contacts at the largest load of a race: race and key of its report.
CONTACTS = {
    f"{race}_{key}": (race, key)
    for race in ("inner", "outer")
    for key in ("max_pressure_MPa", "central_film_um", "minimum_film_um", "lambda_ratio")
}
# Reference life L10r [h] by the static loads at the operating clearance (ISO/TS 16281).
LIFE = "life_h"
# Figures whose mean over time is that of their inverse: 1/L is damage an hour (Palmgren and Miner).
HARMONIC = {LIFE}
NAMES = (*POWERS, *CLEARANCES, LIFE, *CONTACTS)
