#!/usr/bin/env python3
"""Makes distances.json: distances between random pairs of primitives and convex hulls, apart and overlapping.

Distances are from coal (PyPI `coal`). For an overlap the distance is minus the length of the shortest move
that separates the pair. Pairs are left out if a search finds a shorter move than coal, or if coal's
distance differs for the other order."""

from pathlib import Path

import coal
import json_lines
import numpy as np

HERE = Path(__file__).resolve().parent
KINDS = ("box", "sphere", "cylinder", "capsule", "cone", "hull")
EACH = 12


def shape(kind, rng):
    """Returns the sizes in simd's form, and coal's shape."""
    a, b, c = (round(float(x), 3) for x in rng.uniform(0.1, 0.8, 3))
    if kind == "box":
        return [a, b, c], coal.Box(a, b, c)
    if kind == "sphere":
        return [a], coal.Sphere(a)
    if kind == "cylinder":
        return [a, b], coal.Cylinder(a, b)
    if kind == "cone":
        return [a, b], coal.Cone(a, b)
    if kind == "capsule":
        return [a, b], coal.Capsule(a, b)
    corners = np.round(rng.uniform(-1, 1, (int(rng.integers(5, 24)), 3)) * [a, b, c], 3)
    points = coal.StdVec_Vec3s()
    for corner in corners:
        points.append(corner)
    return [float(x) for x in corners.ravel()], coal.Convex.convexHull(points, True, "")


def place(rng, reach):
    """x y z, quaternion x y z w."""
    turn = rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    at = rng.uniform(-1, 1, 3) * reach
    # Rounded first, so that both read the same numbers.
    numbers = [round(float(x), 6) for x in (*at, *turn)]
    turn = np.array(numbers[3:]) / np.linalg.norm(numbers[3:])
    x, y, z, w = turn
    matrix = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])
    return numbers, coal.Transform3s(matrix, np.array(numbers[:3]))


def highest(kind, sizes, transform, ways):
    """Returns the extent of a shape in each direction, one a row."""
    turn, at = transform.getRotation(), transform.getTranslation()
    own = ways @ turn
    across, up = np.hypot(own[:, 0], own[:, 1]), abs(own[:, 2])
    if kind == "box":
        reach = abs(own) @ (np.array(sizes) / 2)
    elif kind == "sphere":
        reach = np.full(len(own), sizes[0])
    elif kind == "cylinder":
        reach = sizes[0] * across + sizes[1] / 2 * up
    elif kind == "cone":
        reach = np.maximum(sizes[0] * across - sizes[1] / 2 * own[:, 2], sizes[1] / 2 * own[:, 2])
    elif kind == "capsule":
        reach = sizes[0] + sizes[1] / 2 * up
    else:
        reach = (own @ np.reshape(sizes, (-1, 3)).T).max(axis=1)
    return reach + ways @ at


def shortest_move(kinds, sizes, transforms):
    """Returns the shortest move that a search over directions finds, which is never too short."""
    index = np.arange(20_000)
    z = 1 - (2 * index + 1) / len(index)
    turn = np.pi * (3 - 5**0.5) * index
    ways = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)

    def moves(ways):
        return highest(kinds[0], sizes[0], transforms[0], ways) + highest(kinds[1], sizes[1], transforms[1], -ways)

    rng = np.random.default_rng(1)
    best = ways[np.argmin(moves(ways))]
    for scale in np.geomspace(0.02, 1e-9, 60):
        around = np.vstack([best, best + scale * rng.normal(size=(500, 3))])
        around /= np.linalg.norm(around, axis=1)[:, None]
        best = around[np.argmin(moves(around))]
    return float(moves(best[None])[0])


def measured(first, second, tolerance):
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    request.gjk_tolerance = request.epa_tolerance = tolerance
    request.gjk_max_iterations = request.epa_max_iterations = 10_000
    result = coal.DistanceResult()
    coal.distance(*first, *second, request, result)
    return float(result.min_distance)


def main():
    rng = np.random.default_rng(14)
    cases, left_out = [], 0
    for i, a in enumerate(KINDS):
        for b in KINDS[i:]:
            for number in range(EACH):
                one, other = shape(a, rng), shape(b, rng)
                reach = 1.5 if number % 3 else 0.25
                at_one, at_other = place(rng, reach), place(rng, reach)
                first, second = (one[1], at_one[1]), (other[1], at_other[1])
                distance = measured(first, second, 1e-10)
                # coal's error, by another tolerance and the other order.
                again = measured(second, first, 1e-8)
                move = shortest_move((a, b), (one[0], other[0]), (at_one[1], at_other[1]))
                if not np.isfinite(distance) or abs(distance - again) > 1e-7 or -distance > max(move, 0) + 1e-7:
                    left_out += 1
                    continue
                cases.append({
                    "shapes": [a, b],
                    "sizes": [one[0], other[0]],
                    "poses": [at_one[0], at_other[0]],
                    "distance": distance,
                })
    print(f"{len(cases)} pairs, {sum(case['distance'] < 0 for case in cases)} overlap, {left_out} left out")
    document = {"made_by": f"coal {coal.__version__}", "cases": cases}
    (HERE / "distances.json").write_text(json_lines.text(document))


if __name__ == "__main__":
    main()
