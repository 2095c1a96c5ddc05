"""Stiffness of a cross-bar by finite elements: three pitches of a window cage in three dimensions (scikit-fem).

Independent of ``rbdyn.contact.cage_bar`` but for what is asked: the middle bar is pushed along the circumference, evenly over the
volume of its loaded length, and its stiffness is the load over the mean displacement of that volume, so that no local field of a
contact enters. Walls of pockets are parallel. The cage is held in the middle of a pocket, one and a half pitches off or farther.
A quarter is meshed: the plane across the middle of the bars mirrors it, the plane along the middle of the loaded bar mirrors it with
the other sign. Hexahedra of 27 nodes.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex2, MeshHex, MeshHex2


@dataclass(frozen=True)
class Divisions:
    """Elements across half a bar, a pocket and the thickness, along half of the load, beyond it, across a side ring; bars on
    each side of the loaded one.
    """

    half_bar: int = 1
    pocket: int = 6
    thickness: int = 2
    load: int = 3
    beyond: int = 2
    ring: int = 3
    bars: int = 1


def bar_stiffness_by_elements(section, modulus, ratio, load, divisions=Divisions()) -> float:
    """Load on a bar over the mean displacement of its loaded length [N/m]; ``section`` has sizes in metres."""
    mesh, loaded = sector(section, load, divisions)
    basis = Basis(mesh, ElementHex2(), intorder=4)
    gradient = np.array([each[0].grad for each in basis.basis])
    value = np.array([np.asarray(each[0]) for each in basis.basis])
    lame, shear = modulus * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio)), modulus / (2.0 * (1.0 + ratio))
    pairs = np.einsum("iaeq,jbeq,eq->eiajb", gradient, gradient, basis.dx, optimize=True)
    stiffness = lame * pairs + shear * pairs.transpose(0, 1, 4, 3, 2)
    for axis in range(3):
        stiffness[:, :, axis, :, axis] += shear * np.einsum("eiaja->eij", pairs)
    dofs = (3 * basis.element_dofs.T[:, :, None] + np.arange(3)).reshape(mesh.nelements, -1)
    width, size = dofs.shape[1], 3 * basis.N
    places = np.repeat(dofs, width, axis=1).ravel(), np.tile(dofs, (1, width)).ravel()
    matrix = coo_matrix((stiffness.ravel(), places), shape=(size, size)).tocsc()
    x, y, _ = basis.global_coordinates()
    around = np.array([y, -x, 0.0 * x]) / np.hypot(x, y)
    force = np.zeros(size)
    shares = np.einsum("ieq,aeq,eq,e->eia", value, around, basis.dx, loaded.astype(float))
    np.add.at(force, dofs, shares.reshape(mesh.nelements, -1))
    force /= basis.dx[loaded].sum()
    angle = np.arctan2(basis.doflocs[0], basis.doflocs[1])
    held = np.zeros((basis.N, 3), bool)
    held[np.abs(basis.doflocs[2]) < 1e-9, 2] = True
    held[np.abs(angle) < 1e-9, 1:] = True
    held[np.abs(angle - 2.0 * np.pi / section.bars * (divisions.bars + 0.5)) < 1e-9] = True
    free = np.nonzero(~held.ravel())[0]
    solver = splu(
        matrix[free][:, free], permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    # A quarter bears a quarter of the load.
    return 4.0 / float(force[free] @ solver.solve(force[free]))


def sector(section, load, divisions) -> tuple[MeshHex2, np.ndarray]:
    """Mesh of the quarter, and which of its elements are loaded."""
    columns, solid = _columns(section, 0.5 * section.pitch_diameter, divisions)
    inner, outer = (0.5 * (section.pitch_diameter + sign * section.thickness) for sign in (-1.0, 1.0))
    half = 0.5 * section.bar_length
    heights = [
        np.linspace(0.0, 0.5 * load, divisions.load + 1),
        np.linspace(0.5 * load, half, divisions.beyond + 1)[1:],
        np.linspace(half, half + section.side_ring_width, divisions.ring + 1)[1:],
    ]
    places = np.arange(len(columns), dtype=float)
    box = MeshHex.init_tensor(places, np.linspace(inner, outer, divisions.thickness + 1), np.concatenate(heights))
    middle = box.p[:, box.t].mean(axis=1)
    box = box.restrict(np.nonzero(solid[middle[0].astype(int)] | (middle[2] > half))[0])
    middle = box.p[:, box.t].mean(axis=1)
    loaded = (middle[0] < divisions.half_bar) & (middle[2] < 0.5 * load)
    curved = MeshHex2.from_mesh(box)
    place, radius, height = curved.doflocs
    angle = np.empty_like(place)
    for ring in np.unique(np.round(radius, 9)):
        on = np.abs(radius - ring) < 1e-8
        angle[on] = np.interp(place[on], places, _columns(section, ring, divisions)[0])
    return MeshHex2(np.array([radius * np.sin(angle), radius * np.cos(angle), height]), curved.t), loaded


def _columns(section, radius, divisions) -> tuple[np.ndarray, np.ndarray]:
    """Angles of the planes of the mesh at a radius, and which columns between them are bars."""
    pitch, wide, pocket = 2.0 * np.pi / section.bars, divisions.half_bar, divisions.pocket
    # Parallel walls: the bar is as much wider as the pitch.
    edge = (0.5 * section.bar_width + (radius - 0.5 * section.pitch_diameter) * 0.5 * pitch) / radius
    parts = [(0.0, edge, wide, True)]
    for bar in range(1, divisions.bars + 1):
        parts.append(((bar - 1) * pitch + edge, bar * pitch - edge, pocket, False))
        parts.append((bar * pitch - edge, bar * pitch + edge, 2 * wide, True))
    parts.append((divisions.bars * pitch + edge, (divisions.bars + 0.5) * pitch, pocket // 2, False))
    angles = [np.linspace(start, end, count + 1)[1:] for start, end, count, _ in parts]
    return np.concatenate([[0.0], *angles]), np.repeat([bar for *_, bar in parts], [count for *_, count, _ in parts])
