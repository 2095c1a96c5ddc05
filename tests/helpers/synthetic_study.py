"""A small made-up record of ``doe study --json`` with every part there is, and a motion to go with it."""

import functools
import itertools
import math
from typing import Any

import numpy as np

from doe.clearance import DrawnMotion
from doe.dimension_chain import Chain, ChainResult, solve

FACTORS = ["radial_clearance_mm", "guide_clearance_mm", "pocket_clearance_mm"]
RESPONSES = ["impact_force_N", "whirl_deviation_ratio", "power_loss_W"]
CENTRE, STEP, REACH = [0.020, 0.15, 0.30], [0.005, 0.05, 0.05], 1.6818
COEFFICIENTS: dict[str, dict[str, float]] = {
    "impact_force_N": {"1": 92.0, "A": 0.3, "B": 2.3, "C": 10.2},
    "whirl_deviation_ratio": {"1": 0.41, "A": -0.004, "B": 0.003, "C": 0.047, "BC": -0.031, "A^2": 0.038},
    "power_loss_W": {"1": 239.0, "A": -1.0, "B": -9.7, "C": -0.6, "B^2": 2.6},
}
VERDICT = {"percent": 11.16, "error_percent": 0.65, "goal": "min", "verdict": "better"}
NOTHING_MISSED = {
    "reachable": True, "limits": [], "at_bounds": [], "beyond": [], "chains": {}, "tolerances": "", "cage": {},
    "sentences": [],
}  # fmt: skip


def predicted(response: str, coded: list[float]) -> float:
    """Value of a made-up surface."""
    a, b, c = coded
    terms = {"1": 1.0, "A": a, "B": b, "C": c, "BC": b * c, "A^2": a * a, "B^2": b * b}
    return sum(value * terms[term] for term, value in COEFFICIENTS[response].items())


def point(coded: list[float], error: float = 0.01) -> dict[str, Any]:
    """Factors, responses and errors of a point of the front."""
    values = {name: predicted(name, coded) for name in RESPONSES}
    return {
        "factors": {name: c + s * x for name, c, s, x in zip(FACTORS, CENTRE, STEP, coded, strict=True)},
        "responses": values,
        "errors": {name: error * abs(value) for name, value in values.items()},
    }


def fitted(name: str, runs: list[list[float]]) -> dict[str, Any]:
    """R of ``doe fit`` for a made-up surface."""
    terms = list(COEFFICIENTS[name])
    rows = [
        ("model", 3, 0.01),
        *((term, 1, 0.01) for term in terms[1:]),
        ("residual", 16, None),
        ("lack_of_fit", 5, 0.2),
    ]
    rows += [("pure_error", 11, None), ("total", 19, None)]
    return {
        "model": "quadratic",
        "coefficients": COEFFICIENTS[name],
        "terms": terms,
        "covariance": (0.01 * np.eye(len(terms))).tolist(),
        "vif": dict.fromkeys(terms[1:], 1.0),
        "residual_dof": 16,
        "observation_variance": 1.5,
        "actual_coefficients": COEFFICIENTS[name],
        "blocks": {},
        "elimination": [],
        **dict.fromkeys(("box_cox", "canonical", "known_variance", "model_error", "rival")),
        "anova": [{"source": source, "ss": 1.5, "df": df, "ms": 1.5, "f": 4.0, "p": p} for source, df, p in rows],
        **{"r2": 0.98, "adjusted_r2": 0.97, "predicted_r2": 0.9, "press": 3.0},
        **{"cv_percent": 1.2, "adequate_precision": 20.0},
        "stationary_point": {"coded": [0.0] * 3, "actual": CENTRE, "eigenvalues": [1.0] * 3, "nature": "minimum"},
        "diagnostics": {
            "runs": [
                {
                    "run": run + 1,
                    "observed": predicted(name, coded) + 0.1 * math.sin(run),
                    "predicted": predicted(name, coded),
                    "residual": 0.1 * math.sin(run),
                    "standardized": math.sin(run),
                    "studentized": math.sin(run),
                    "leverage": 0.4,
                    "cook": 0.1,
                }
                for run, coded in enumerate(runs)
            ],
            "normality": {"test": "Shapiro-Wilk", "w": 0.95, "p": 0.4},
            "outlier": {"test": "Bonferroni", "run": 3, "studentized": 0.9, "p": 1.0},
            "high_leverage": [],
            "influential": [],
        },
        "transform": None,
    }


def summary() -> dict[str, Any]:
    """Every part of the record."""
    cube: list[list[float]] = [list(corner) for corner in itertools.product((-1.0, 1.0), repeat=3)]
    runs = [*cube, *([0.0] * 3 for _ in range(4))]
    front = [point([0.5, 1.0 - 0.1 * k, -1.6 + 0.1 * k]) | {"non_dominated_probability": 0.9} for k in range(12)]
    robust = [
        {key: each[key] for key in ("factors", "responses")} | {"robust": each["responses"]} for each in front[:6]
    ]
    pick, baseline = front[3], point([0.0, 0.0, 0.0])
    limits = [(c - REACH * s, c + REACH * s) for c, s in zip(CENTRE, STEP, strict=True)]
    simulated = {
        name: {"value": value, "statistical_error": 0.3, "numerical_error": 0.2}
        for name, value in baseline["responses"].items()
    }
    chosen = {"radial_clearance_mm": 0.0225, "guide_clearance_mm": 0.185, "pocket_clearance_mm": 0.235}
    confirmed = {
        "factors": chosen,
        "reason": "",
        "responses": simulated,
        "power_terms_W": {},
        "limits": {},
        "every_limit": [],
        "cage": {},
    }
    return {
        "format": "doe.study/2",
        "identity": {"command": "doe study", "bearing": "made-up bearing", "drawing": "", "point": "24000 rpm",
                     "date": "2026-01-31", "version": "0.1.0", "files": {}},
        "status": "ok",
        "limits": {},
        "obstacles": NOTHING_MISSED,
        "tried": 1,
        "edge": {"beyond_runs": False, "factors": {}, "front_share": 0.1, "direct_front_share": None,
                 "sentence": "The selected design lies inside the region; 10 % of the front lies within 4 % of a bound of the region."},
        "asked": {
            "study_file": "study.toml",
            "scene_file": "scene.toml",
            "scene": {"bearing": {"rollers": 10, "roller_diameter_mm": 9.0, "roller_profile": None}},
            "factors": [
                {"letter": "ABC"[k], "name": name, "key": f"bearing.{name}", "centre": CENTRE[k], "step": STEP[k],
                 "low": limits[k][0], "high": limits[k][1], "resolution": 0.0005, "tolerance": None}
                for k, name in enumerate(FACTORS)
            ],
            "responses": [
                {"goal": "min", "target": None, "lower": None, "upper": None, "weight": 1.0, "model": "quadratic",
                 "transform": "none", "name": name} for name in RESPONSES
            ],
            "replicates": 8,
            "design_replicates": 8,
            "turns": 40,
            "confirmation_replicates": 16,
        },
        "design": {
            "kind": "central_composite",
            "runs": len(runs),
            "factors": FACTORS,
            "responses": RESPONSES,
            "points": [
                {"run": run + 1, "kind": "cube" if run < 8 else "centre", "block": 1, "seed": run + 1,
                 "coded": dict(zip(FACTORS, coded, strict=True)), "factors": point(coded)["factors"],
                 "responses": {name: {"value": predicted(name, coded), "error": 0.2} for name in RESPONSES}}
                for run, coded in enumerate(runs)
            ],
            "evaluation": {
                "model": "quadratic", "terms": ["1", "A", "B", "C"], "runs": len(runs), "region": {"shape": "ball", "reach": REACH},
                "efficiency_percent": {"d": 68.2, "g": 71.0},
                "scaled_prediction_variance": {"centre": 3.0, "mean": 8.0, "max": 14.0, "box_max": 20.0},
                "by_radius": [{"radius": r, "min": 1 + r, "mean": 2 + r, "max": 3 + r} for r in (0.0, 1.0)],
                "fraction_of_design_space": [{"percent": p, "variance": 3 + p / 50} for p in (0, 50, 100)],
                "vif": {"A": 1.0, "B": 1.0, "C": 1.02}, "leverage": [0.3] * len(runs), "condition_number": 3.4,
                "degrees_of_freedom": {"model": 3, "residual": 8}, "blocks": None,
                "power_percent": {term: {"one_sigma": 30.0, "two_sigma": 80.0} for term in "ABC"},
            },
            "failures": [{"cause": "step budget used up", "runs": [13], "labels": ["run 13"]}],
        },
        "fit": {"responses": {name: fitted(name, runs) for name in RESPONSES}},
        "front": {
            "front": front, "knee": front[5], "picks": {"desirability": front[8]}, "baseline": baseline,
            "pick": {**pick, "reason": "the knee of the front", "beyond_runs": False, "at_bounds": {}},
            "hypervolume": 0.9, "largest_hypervolume": 1.331, "hypervolume_history": [0.7, 0.85, 0.9], "ideal": {}, "nadir": {},
            "pick_dominates_baseline": {"probability": 0.9, "standard_error": 0.01, "draws": 1000},
            "predicted_gains": {
                name: {**VERDICT, "goal": "min"} for name in RESPONSES
            },
            "statement": "", "archive": 12, "feasible_share": 1.0, "evaluations": 300, "generations": 3, "seed": 1,
            "constraints": [{"response": "power_loss_W", "sense": "<=", "limit": 260.0, "value": 230.0, "error": None, "kept": True,
                             "probability": 0.99, "demanded_probability": 0.95}],
            "tolerance_aware": {
                "kind": "worst_case", "quantile": None, "distribution": "uniform", "half_widths": {},
                "front": robust, "hypervolume": 0.8, "pick": {**robust[3], "reason": "the knee"}, "picks": {},
                "baseline_robust": {}, "plain_pick_robust": {}, "nominal_loss_percent": 1.0,
                "robust_gain_percent": None, "pick_gains_percent": {},
                "survival": {**dict.fromkeys(("plain_pick", "pick", "standard_error", "plain_pick_interval", "pick_interval")),
                             "open_errors": ""},
            },
        },
        "pick_on_surfaces": {key: pick[key] for key in ("factors", "responses", "errors")},
        "pick": chosen,
        "operating_clearances_mm": {},
        "clearance_class": "",
        "whirl_sentence": "",
        "rivals_sentences": [],
        "made": {},
        "missed_chains": {},
        "inputs": "0123456789abcdef",
        "tolerances": {
            FACTORS[0]: {"half_width": 0.004, "probability": 0.95, "standard_error": 0.01, "interval": [0.9, 0.98], "grade": None,
                         "parts": {}, "limited_by": RESPONSES[0], "without_limiting_gain": None}
        },
        "confirmation": {
            "baseline": confirmed | {"factors": baseline["factors"], "power_terms_W": {"land": 70.0, "drag": 36.0, "nil": 0.0}},
            "pick": confirmed | {"power_terms_W": {"land": 66.0, "drag": 36.0}},
            "knee": confirmed | {"gains": {RESPONSES[0]: VERDICT}, "statement": "", "reason": "the knee"},
        },
        "gains": dict.fromkeys(RESPONSES, VERDICT),
        "statement": "The gain is real in all three responses.",
        "chains": {"pocket": pocket_chain().as_dict()},
        "published_comparisons": {
            RESPONSES[0]: {
                "ours_min_mean_max": [77.0, 92.0, 114.0], "theirs_min_mean_max": [145.0, 203.0, 278.0],
                "linear_effects": {FACTORS[0]: {"ours": 0.3, "theirs": 23.0, "same_sign": True}},
                "rank_correlation": 0.7, "verdict": f"{RESPONSES[0]}: our mean is 0.45 of theirs.", "why": "They leave out mass.",
            }
        },
        "notes": [{"level": "note", "code": "traction-law", "text": "traction: one set of constants"}],
        "failures": [{"cause": "step budget used up", "runs": [13, 15], "labels": ["run 13", "run 15"]}],
        "cost": {"design_s": 31.5, "total_s": 36.1},
        "versions": {"rbdyn": "0.1.0"},
        "seeds": {"design": 1},
    }  # fmt: skip


@functools.cache
def pocket_chain() -> ChainResult:
    """A chain of two parts with allocated deviations."""
    links = [
        {"name": "pocket_width", "coefficient": 1.0, "nominal_mm": 9.24},
        {"name": "roller_diameter", "coefficient": -1.0, "nominal_mm": 9.0},
    ]
    limits = {"lower_mm": 0.23, "upper_mm": 0.24}
    return solve(Chain.model_validate({"closing_link": limits, "link": links}), samples=1000)


def searched(emulators: dict[str, Any] | None = None) -> dict[str, Any]:
    """The record of a made-up search in few runs."""
    front = [point([0.5, 1.0 - 0.1 * k, -1.6 + 0.1 * k]) for k in range(4)]
    batches = [(20, 0.8, "improvement"), (26, 0.9, "check")]
    return {
        "front": front, "pick": {**front[1], "reason": "the knee"}, "runs": 26, "fresh": 20, "hypervolume": 0.9,
        "hypervolume_fresh": 0.88, "hypervolume_fresh_error": 0.02, "stopped": "the budget is spent", "extended": [],
        "history": [{"runs": runs, "hypervolume": volume, "deviation": 0.01, "gained": None, "left": 0.02, "left_error": 0.01,
                     "why": why} for runs, volume, why in batches],
        "region": {name: [c - REACH * s, c + REACH * s] for name, c, s in zip(FACTORS, CENTRE, STEP, strict=True)},
        "points": [{"factors": each["factors"], "replicates": 8, "why": "design"} for each in front],
        "predicted_front_points": 4, "predicted_front": [],
        "missed": {name: {"bias": 0.1, "spread": 1.0} for name in RESPONSES},
        "emulators": emulators or {"centre": CENTRE, "half_range": STEP, "points": [], "responses": {}},
        "failed": 0, "seed": 1, "seconds": 3.0, "emulator_seconds": 1.0,
        "compared": {"ideal": {}, "nadir": {}, "search": [volume for _, volume, _ in batches], "surfaces": 0.7,
                     "fresh": {"hypervolume": 0.88, "error": 0.02}},
        "held": "What limits the selected design: nothing.",
        "sentences": ["The selected design has a clearance of 0.0225 mm.", "80 runs and 20 fresh ones."],
    }  # fmt: skip


def motion(rollers: int = 6, frames: int = 40) -> dict[str, DrawnMotion]:
    """Motions of baseline and pick: rollers going round at even speed."""
    turn = 2.0 * math.pi
    still, each = [0.0] * frames, [0.0] * (frames * rollers)
    angles = [round(0.4 * turn * frame / frames, 4) for frame in range(frames)]
    moving = {
        "title": "a made-up bearing", "frames": frames, "rollers": rollers, "turn_s": 2.5e-3,
        "pitch": 21.75, "roller": 2.8, "cage_half": 1.1, "outer_gap": 0.01, "inner_gap": 0.01, "pocket_gap": 0.15,
        "guide_gap": 0.075, "guide_side": 1.0, "race_scale": 100.0, "cage_scale": 10.0, "extent": 34.0,
        "magnification": 10.0, "largest_magnification": 16.0,
        "references": [[-30.0, 28.0, -25.0, 28.0, "outer race, 500 N", -22.0]],
        "time_us": [5000.0 * frame / frames for frame in range(frames)],
        "inner_angle": [2.0 * turn * frame / frames % turn for frame in range(frames)], "outer_angle": still,
        "cage_angle": angles, "cage_x_um": still, "cage_y_um": still, "ring_x_um": still, "ring_y_um": still,
        "ahead_um": each, "out_um": each, "spin": each, "outer_load_N": [500.0] * len(each), "inner_load_N": each,
        "pocket_load_N": [20.0] * len(each), "land_load_N": still,
    }  # fmt: skip
    orbit = tuple([20.0 * trig(0.1 * k) for k in range(60)] for trig in (math.cos, math.sin))
    return dict.fromkeys(("baseline", "pick"), DrawnMotion(orbit, 75.0, moving))
