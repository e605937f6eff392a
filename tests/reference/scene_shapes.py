"""Meshes and heights of the scenes: lists of corners and triangles, counterclockwise as seen from outside."""

import random
from math import cos, pi, sin


def turn_about(axis, angle):
    """The quaternion, x y z w."""
    return [part * sin(angle / 2) for part in axis] + [cos(angle / 2)]


def sheet(cells, size, height, shift=0.0):
    """Returns the surface above a grid of this many cells along x and y on these edges, m. Inner corners are
    moved by up to `shift` of a cell, so that no two triangles are alike. Heights are functions of x and y."""
    (nx, ny), chance = cells, random.Random(3)
    vertices = []
    for row in range(ny + 1):
        for column in range(nx + 1):
            inner = 0 < row < ny and 0 < column < nx
            dx, dy = (shift * inner * (chance.random() - 0.5) for _ in range(2))
            x, y = ((column + dx) / nx - 0.5) * size[0], ((row + dy) / ny - 0.5) * size[1]
            vertices.append([x, y, height(x, y)])
    triangles = []
    for row in range(ny):
        for column in range(nx):
            a = row * (nx + 1) + column
            b, c, d = a + 1, a + nx + 1, a + nx + 2
            triangles += [[a, b, d], [a, d, c]]
    return vertices, triangles


def rows(cells, size, height):
    """Returns heights on the same grid, row by row from the largest y down."""
    (nx, ny) = cells
    return [[height((i / nx - 0.5) * size[0], (0.5 - j / ny) * size[1]) for i in range(nx + 1)] for j in range(ny + 1)]


def stairs(count, high, deep, wide, before):
    """Returns treads and risers as one sheet. It begins `before` the first riser, at x = 0, and extends as
    far on top."""
    profile = [(-before, 0.0)]
    for step in range(count):
        profile += [(step * deep, step * high), (step * deep, (step + 1) * high)]
    profile.append(((count - 1) * deep + before, count * high))
    vertices = [[x, y, z] for x, z in profile for y in (-wide / 2, wide / 2)]
    triangles = []
    for i in range(len(profile) - 1):
        a, b, c, d = 2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3
        triangles += [[a, c, d], [a, d, b]]
    return vertices, triangles


def boxes(parts):
    """Returns one mesh of several boxes: the middle and the edges of each, m."""
    vertices, triangles = [], []
    for middle, edges in parts:
        first = len(vertices)
        vertices += [[m + e * s / 2 for m, e, s in zip(middle, edges, (x, y, z))]
                     for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        for a, b, c, d in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)):
            triangles += [[first + a, first + b, first + c], [first + a, first + c, first + d]]
    return vertices, triangles


def bowl(radius, height, rings, sectors):
    """A paraboloid that is open above, its lowest point at the origin."""
    vertices = [[0.0, 0.0, 0.0]]
    for ring in range(1, rings + 1):
        r = radius * ring / rings
        turns = (2 * pi * sector / sectors for sector in range(sectors))
        vertices += [[r * cos(turn), r * sin(turn), height * (ring / rings) ** 2] for turn in turns]
    triangles = [[0, 1 + i, 1 + (i + 1) % sectors] for i in range(sectors)]
    for ring in range(rings - 1):
        for i in range(sectors):
            a, b = 1 + ring * sectors + i, 1 + ring * sectors + (i + 1) % sectors
            triangles += [[a, a + sectors, b + sectors], [a, b + sectors, b]]
    return vertices, triangles


def wedge(inner, outer, angle, deep):
    """Returns a stone of a round arch, its middle's direction along z: corners, distance and moments. Corners
    are about its centre of mass. The distance is from there to the arch's centre. The principal moments
    are for a mass of 1 kg."""
    half = angle / 2
    a, h = outer * cos(half), inner * cos(half)
    # A trapezium: half its width at height z is z times the tangent of half the angle.
    slope = sin(half) / cos(half)
    area = slope * (a**2 - h**2)
    middle = slope * 2 / 3 * (a**3 - h**3) / area
    along = slope / 2 * (a**4 - h**4) / area - middle**2
    across = slope**3 / 6 * (a**4 - h**4) / area
    corners = [[x * slope * z, y * deep / 2, z - middle] for z in (h, a) for x in (-1, 1) for y in (-1, 1)]
    moment = [along + deep**2 / 12, along + across, across + deep**2 / 12]
    return corners, middle, moment
