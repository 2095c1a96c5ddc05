"""Solvers of the equilibrium of balls beside the convex one: full system, plain Newton, MINPACK, finite search, battery."""

import ball_solvers
import minpack
import numpy as np
import pytest
from ball_battery import CONTROLS, LOADS, cases, posed
from conftest import ROOT
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_newton import plain_newton

from rbdyn import Scene, accuracy
from rbdyn.accuracy.ball_solvers import problem_of
from rbdyn.accuracy.report import Progress
from rbdyn.base.faults import InputError
from rbdyn.quasistatic import finite_search, full_system
from rbdyn.quasistatic.bearing import equilibrium as solve_scene
from rbdyn.quasistatic.finite_search import loaded, search_points
from rbdyn.quasistatic.full_system import evaluate, forces, system_of, unknowns
from rbdyn.quasistatic.row import equilibrium
from rbdyn.quasistatic.row.model import constraint_of, load_of, row_of
from rbdyn.quasistatic.row.newton import eliminate
from rbdyn.scene import BallScene

BALLS = ROOT / "examples" / "angular_contact_ball.toml"


@pytest.fixture(scope="module")
def problem():
    """The shipped example, as a solver takes it: outer raceway control, tilt held."""
    return problem_of(Scene.load(BALLS))


@pytest.fixture(scope="module")
def ours(problem):
    """Its equilibrium by the convex solver."""
    return equilibrium.solve(*problem)


def at(problem, solution):
    """The system and its unknowns at a solution."""
    system = system_of(problem.row, problem.load, problem.fixed)
    lever = problem.row.lever
    return system, unknowns(system, solution.displacement * [1.0, 1.0, 1.0, lever, lever], solution.balls)


def filled(control, system, u, function=evaluate):
    """Residual, Jacobian and the two sizes."""
    residual, jacobian = np.zeros(system.size), np.zeros((system.size, system.size))
    return residual, jacobian, *function(control, system, u, residual, jacobian)


@pytest.mark.parametrize("interpreted", [False, True])
def test_unit_elimination_solves_and_tells_singular_matrices(interpreted):
    solve = eliminate.py_func if interpreted else eliminate
    draw = np.random.default_rng(3)
    matrix, vector = draw.normal(size=(7, 7)), draw.normal(size=7)
    matrix[0, 0] = 0.0
    expected, matrix_left = np.linalg.solve(matrix, vector), matrix.copy()
    assert solve(matrix_left, vector, 7, 0.0)
    assert vector == pytest.approx(expected, rel=1e-10)
    assert not solve(matrix.copy(), np.ones(7), 7, 1e3)
    matrix[:, 3] = 0.0
    assert not solve(matrix.copy(), np.ones(7), 7, 0.0)
    # The first three equations alone can be solved.
    expected, part = np.linalg.solve(matrix[:3, :3], np.ones(3)), np.ones(7)
    assert solve(matrix, part, 3, 0.0) and part[:3] == pytest.approx(expected, rel=1e-10) and (part[3:] == 1.0).all()
    assert not solve(np.full((2, 2), np.nan), np.ones(2), 2, 0.0)


def test_invariant_the_convex_solution_leaves_nothing_in_the_full_system(problem, ours):
    system, u = at(problem, ours)
    _, _, worst, largest = filled(problem.control, system, u)
    assert worst < 1e-10 * largest
    assert system.size == 2 * problem.row.cosine.size + 3


def test_unit_jacobian_by_differences(problem, ours):
    """Tilt free and a couple on the ring: all five components, away from the equilibrium."""
    free = problem._replace(fixed=np.full(5, np.nan), load=np.array([200.0, 5.0, 200.0, 0.3, -0.2]))
    system, u = at(free, ours)
    u = u + 1e-7 * np.random.default_rng(5).normal(size=u.size)
    _, jacobian, _, _ = filled(free.control, system, u)
    step = 1e-11
    for i in range(u.size):
        ahead, behind = u.copy(), u.copy()
        ahead[i] += step
        behind[i] -= step
        slope = (filled(free.control, system, ahead)[0] - filled(free.control, system, behind)[0]) / (2.0 * step)
        assert slope == pytest.approx(jacobian[:, i], abs=1e-6 * np.abs(jacobian).max())


def test_unit_forces_are_the_same_interpreted(problem, ours):
    system, u = at(problem, ours)
    compiled, alone = filled(problem.control, system, u), filled(problem.control, system, u, forces.py_func)
    assert alone[0] == pytest.approx(compiled[0], abs=1e-9)
    assert alone[1] == pytest.approx(compiled[1], rel=1e-9, abs=1e-3)


def test_oracle_the_schur_complement_is_the_rings_stiffness(problem, ours):
    """Eliminating the balls from the dense Jacobian gives the stiffness that the O(Z) solver reports."""
    free = problem._replace(fixed=np.full(5, np.nan))
    system, u = at(free, ours)
    _, jacobian, _, _ = filled(free.control, system, u)
    n = 2 * problem.row.cosine.size
    inner = np.linalg.solve(jacobian[:n, :n], jacobian[:n, n:])
    reduced = -(jacobian[n:, n:] - jacobian[n:, :n] @ inner)
    unit = np.array([1.0, 1.0, 1.0, problem.row.lever, problem.row.lever])
    assert reduced * np.outer(unit, unit) == pytest.approx(
        ours.stiffness, rel=1e-6, abs=1e-6 * np.abs(ours.stiffness).max()
    )


@pytest.mark.parametrize(
    "solver",
    [
        plain_newton, finite_search.solve, minpack.SOLVERS["MINPACK hybrid"], minpack.SOLVERS["MINPACK LM"],
        full_system.convex_with_limit,
    ],
)  # fmt: skip
def test_oracle_all_solvers_find_the_same_equilibrium(solver):
    """At a load where each of them converges."""
    problem = problem_of(Scene.load(BALLS, ["operation.axial_load_N=2000", "operation.inner_speed_rpm=5000"]))
    ours, theirs = equilibrium.solve(*problem), solver(*problem)
    assert ours.status == theirs.status == "ok"
    assert theirs.displacement == pytest.approx(ours.displacement, rel=1e-6, abs=1e-13)
    assert theirs.inner_load == pytest.approx(ours.inner_load, rel=1e-6)
    assert theirs.stiffness == pytest.approx(ours.stiffness, rel=1e-4, abs=1e-4 * np.abs(ours.stiffness).max())


@given(balls=st.integers(3, 12), angle=st.floats(1.0, 44.0), step=st.floats(0.01, 0.5))
@settings(deadline=None, max_examples=25)
def test_invariant_search_points_lie_outside_both_circles_and_turn_inward(balls, angle, step):
    """Rules b and c along the tangent; the first point touches both circles."""
    data = {
        "bearing": {
            "kind": "angular_contact_ball",
            "balls": balls,
            "ball_diameter_mm": 5.0,
            "pitch_diameter_mm": 40.0,
            "contact_angle_deg": angle,
            "inner_groove_factor": 0.52,
            "outer_groove_factor": 0.53,
        },
        "operation": {"axial_load_N": 100.0},
    }
    row = row_of(BallScene.from_dict(data)).row
    points = search_points(row, finite_search.Search(step=step))
    out = np.linalg.norm(points, axis=2) - row.outer_reach
    centre = np.stack((row.axial, row.radial), axis=1)
    within = np.linalg.norm(points - centre, axis=2) - row.inner_reach
    assert np.abs([out[0], within[0]]).max() < 1e-15
    along = slice(1, finite_search.SEARCH.along + 1)
    assert (out[along] > 0.0).all() and (within[along] > 0.0).all()
    outer_angle = np.arctan2(points[: along.stop, :, 0], points[: along.stop, :, 1])
    assert (np.diff(outer_angle, axis=0) < 0.0).all()
    assert outer_angle[0] == pytest.approx(np.radians(angle))


def test_unit_offset_distance_is_that_of_the_means():
    from paper_000_finite_search import offset_distances

    points = np.array([[[0.0, 0.0], [2.0, 0.0]], [[1.0, 3.0], [1.0, 5.0]]])
    assert offset_distances(points, np.array([[1.0, 0.0, 9.0, 9.0], [1.0, 0.0, 9.0, 9.0]])) == pytest.approx([0.0, 4.0])


def test_limit_rule_a_refuses_unloaded_balls_only_as_printed():
    """A radial load lifts the balls on the far side: lawful, and refused where rule a is taken by its word."""
    deep = ["bearing.contact_angle_deg=0", "operation.axial_load_N=0", "operation.prescribed.z_mm=0.0"]
    problem = problem_of(Scene.load(BALLS, [*deep, "operation.inner_speed_rpm=5000"]))
    lawful, strict = finite_search.solve(*problem), finite_search.solve(*problem, strict=True)
    assert lawful.is_equilibrium and (lawful.inner_load == 0.0).any()
    assert not strict.is_equilibrium and "rule a" in strict.status
    system, u = at(problem, lawful)
    assert not loaded(system, u)
    assert lawful.displacement == pytest.approx(equilibrium.solve(*problem).displacement, rel=1e-6, abs=1e-13)


@pytest.mark.parametrize("solver", ["finite_search", "convex"])
def test_unit_the_scene_chooses_the_solver(solver):
    found = solve_scene(Scene.load(BALLS, [f"model.solver={solver}"])).as_dict()
    assert found["status"] == "ok" and found["solver"] == solver
    assert ("searches" in found) == (solver == "finite_search")
    assert found["displacement_mm"]["x"] == pytest.approx(4.965e-3, rel=1e-3)


def test_extreme_a_rival_that_fails_says_why():
    """Standing balls under a radial load: those that nothing holds make Newton's matrix singular."""
    found = plain_newton(*problem_of(Scene.load(BALLS, ["operation.inner_speed_rpm=0"])))
    assert not found.is_equilibrium and "singular" in found.status
    problem = problem_of(Scene.load(BALLS))
    for solver, told in (
        (plain_newton, "2 steps"),
        (finite_search.solve, "searches"),
        (minpack.SOLVERS["MINPACK hybrid"], "MINPACK"),
    ):
        stopped = solver(*problem, limit=2)
        assert not stopped.is_equilibrium and told in stopped.status
        assert all(np.isfinite(part).all() for part in stopped[:10])
        assert np.isfinite(stopped.residual) and stopped.residual > 0.0


def test_unit_battery_poses_what_its_scenes_pose():
    """The fast way past the validation gives the bits that a file would."""
    drawn = cases(120, seed=7)
    assert {case.control for case in drawn} == set(CONTROLS) and {case.load for case in drawn} == set(LOADS)
    for case in drawn:
        scene = BallScene.from_dict({"bearing": case.bearing, "operation": case.operation, "model": case.model})
        model, fast = row_of(scene), posed(case)
        assert all(np.array_equal(a, b) for a, b in zip(model.row, fast.row, strict=True))
        assert model.control == fast.control
        assert np.array_equal(load_of(scene), fast.load)
        assert np.array_equal(constraint_of(scene), fast.fixed, equal_nan=True)


def test_unit_solver_study_of_a_scene(tmp_path):
    from rbdyn.accuracy import write

    told = []
    ours = accuracy.study("methods", Scene.load(BALLS))
    assert {row["solver"] for row in ours.record["rows"]} == {"convex"}
    assert ours.sentences[-1].startswith("An equilibrium of this scene takes ")
    found = ball_solvers.study(Scene.load(BALLS), lambda done, total: told.append((done, total)), (2, 30), 3)
    rows = {(row["solver"], row["limit"]): row for row in found.record["rows"]}
    assert rows["convex", 30]["status"] == rows["finite search", 30]["status"] == "ok"
    assert rows["convex", 30]["residual"] < 1e-10 < rows["convex", 2]["residual"]
    assert told[-1] == (len(ball_solvers.LIMITED) * 5,) * 2
    assert found.record["nearby"][0] == {**found.record["nearby"][0], "solver": "convex", "solved": 1.0}
    assert "Take convex" in found.sentences[-1]
    assert set(write(found, tmp_path)) == {"solvers.json", "solvers.csv", "solvers.png"}


def test_unit_progress_and_failed_references(problem):
    from rbdyn.base.faults import RunError

    impossible = problem._replace(load=np.array([np.inf, 0.0, 0.0, 0.0, 0.0]))
    with pytest.raises(RunError, match="nothing to compare"):
        ball_solvers.work_precision(impossible, (1,), Progress(None, 1))


def test_command_line_has_the_studies_of_the_kind_of_bearing(command):
    """A ball bearing has the study of its solvers, which is also the usual one; others are refused by name."""
    scene = BallScene.load(BALLS)
    assert accuracy.study_name(None, scene) == accuracy.study_name("methods", scene) == "methods"
    ended = command("accuracy", BALLS, "coverage")
    assert ended.returncode == 2
    assert ended.stderr.startswith(
        "coverage: is not a study of a bearing of kind 'angular_contact_ball'; choose methods"
    )


def test_unit_two_rows_are_refused():
    file = ROOT / "examples" / "double_decker.toml"
    with pytest.raises(InputError, match="take one of its rows"):
        accuracy.study("methods", BallScene.load(file))
    with pytest.raises(InputError, match=r"model\.solver = 'finite_search': solves a single row"):
        BallScene.load(file, ["model.solver=finite_search"])
