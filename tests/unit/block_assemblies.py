"""Rigid blocks in the plane for limit analysis, the four hinges of an arch, and tables."""

from itertools import combinations

import numpy as np
from scipy import sparse

import amontons as am

SQUARE = [(-1, -1), (1, -1), (1, 1), (-1, 1)]


def assembly(blocks, joints, mu, live):
    """Blocks (k, 2) of unit weight per area; joints (block, other or -1, two ends, normal).

    live(k, centre, area): (force, point) that grows, on block k.  The problem and live load.
    """
    size, centres, areas = 3 * len(blocks), [], []
    for points in blocks:
        x, y = points.T
        cross = x * np.roll(y, -1) - np.roll(x, -1) * y
        area = cross.sum() / 2
        middle = ((x + np.roll(x, -1)) @ cross, (y + np.roll(y, -1)) @ cross)
        centres.append(np.array(middle) / (6 * area))
        areas.append(area)
    columns = []
    for k, other, ends, normal in joints:
        for end in ends:
            for axis in (normal, (-normal[1], normal[0])):
                column = np.zeros(size)
                for body, sign in ((k, 1), (other, -1)):
                    if body >= 0:
                        arm = end - centres[body]
                        moment = arm[0] * axis[1] - arm[1] * axis[0]
                        column[3 * body : 3 * body + 3] = np.array([*axis, moment]) * sign
                columns.append(column)
    dead, grows = np.zeros(size), np.zeros(size)
    for k, (centre, area) in enumerate(zip(centres, areas, strict=True)):
        dead[3 * k + 1] = -area
        force, point = live(k, centre, area)
        arm = point - centre
        grows[3 * k : 3 * k + 3] = *force, arm[0] * force[1] - arm[1] * force[0]
    H = sparse.csc_array(np.array(columns).T)
    nc = H.shape[1] // 2
    M = sparse.eye_array(size, format="csc")
    problem = am.FrictionProblem.from_global(M, H, dead, np.zeros((nc, 2)), np.full(nc, mu))
    return problem, grows


def voussoirs(radius, thickness, angle, count):
    """Blocks from right to left, and the angles of their joints."""
    at = np.linspace(np.pi / 2 - angle / 2, np.pi / 2 + angle / 2, count + 1)
    inner, outer = radius - thickness / 2, radius + thickness / 2

    def point(r, a):
        return r * np.array([np.cos(a), np.sin(a)])

    blocks = [
        np.array([point(inner, a), point(outer, a), point(outer, b), point(inner, b)])
        for a, b in zip(at[:-1], at[1:], strict=True)
    ]
    ends = [(point(inner, a), point(outer, a)) for a in at]
    return blocks, at, ends


def arch(radius, thickness, angle, count, mu, live):
    blocks, at, ends = voussoirs(radius, thickness, angle, count)
    joints = []
    for k, a in enumerate(at):
        along = np.array([-np.sin(a), np.cos(a)])
        if k == count:
            joints.append((count - 1, -1, ends[k], -along))
        else:
            joints.append((k, k - 1, ends[k], along))
    return assembly(blocks, joints, mu, live)


def four_hinges(radius, thickness, angle, count, live):
    """The least factor over all mechanisms of four alternating hinges (Heyman 1982).

    Three rigid links between hinges turn about their instantaneous centres; the factor is
    minus the power of the dead over that of the live load.
    """
    blocks, _, ends = voussoirs(radius, thickness, angle, count)
    weights = []
    for points in blocks:
        x, y = points.T
        cross = x * np.roll(y, -1) - np.roll(x, -1) * y
        area = cross.sum() / 2
        middle = np.array([(x + np.roll(x, -1)) @ cross, (y + np.roll(y, -1)) @ cross])
        weights.append((area, middle / (6 * area)))
    best = np.inf
    for joints in combinations(range(count + 1), 4):
        for first in (0, 1):
            sides = [(first + k) % 2 for k in range(4)]
            factor = _factor(joints, [ends[j] for j in joints], sides, weights, live)
            if factor is not None:
                best = min(best, factor)
    return best


def _factor(joints, ends, sides, weights, live):
    a, b, c, d = hinges = [pair[side] for pair, side in zip(ends, sides, strict=True)]
    cross = (b - a)[0] * (d - c)[1] - (b - a)[1] * (d - c)[0]
    if abs(cross) < 1e-9:
        return None
    t = ((c - a)[0] * (d - c)[1] - (c - a)[1] * (d - c)[0]) / cross
    centre = a + t * (b - a)  # of the middle link
    links = [(a, 1.0)]
    turn = _turn(b - a, b - centre)
    last = turn * _turn(c - centre, c - d)
    links += [(centre, turn), (d, last)]
    rates = [0.0, 1.0, turn, last, 0.0]
    opens = []
    for k, (pair, side) in enumerate(zip(ends, sides, strict=True)):
        arm = pair[1 - side] - hinges[k]  # to the end of the joint that opens
        along = np.array([-(pair[1] - pair[0])[1], (pair[1] - pair[0])[0]])  # to the next block
        opens.append((rates[k + 1] - rates[k]) * (np.array([-arm[1], arm[0]]) @ along))
    if min(opens) < 0 < max(opens):
        return None  # some hinge would have to close
    sense = np.sign(sum(opens))
    dead = grows = 0.0
    for k, (area, middle) in enumerate(weights):
        link = sum(k >= j for j in joints) - 1
        if not 0 <= link < 3:
            continue
        pivot, rate = links[link]
        force, point = live(k, middle, area)

        def moved(x, pivot=pivot, rate=rate):
            return rate * np.array([-(x - pivot)[1], (x - pivot)[0]])

        dead += -area * moved(middle)[1]
        grows += np.array(force) @ moved(np.asarray(point))
    return -dead / grows if sense * grows > 0 and -dead / grows > 0 else None


def _turn(before, after):
    """Rate about the second pivot for the motion that the first gives: v = w x r."""
    k = np.abs(after).argmax()
    return before[k] / after[k]


def column(count, width, height, mu):
    """Blocks one on another, pushed sideways in proportion to their weight."""
    blocks = [np.array([[0, k * height], [width, k * height], [width, (k + 1) * height],
                        [0, (k + 1) * height]]) for k in range(count)]  # fmt: skip
    joints = [(k, k - 1, (np.array([0, k * height]), np.array([width, k * height])), (0.0, 1.0))
              for k in range(count)]  # fmt: skip
    return assembly(blocks, joints, mu, sideways)


def sideways(k, centre, area):
    return (area, 0.0), centre


def table(legs, weight=4.0, mu=0.5, height=1.0):
    """A rigid table on a floor, its mass 1 at a height above the feet (k, 2)."""
    H = np.zeros((6, 3 * len(legs)))
    axes = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], dtype=float)  # normal, tangents
    for k, (x, y) in enumerate(legs):
        for a, axis in enumerate(axes):
            H[:3, 3 * k + a] = axis
            H[3:, 3 * k + a] = np.cross([x, y, -height], axis)
    f = np.array([0, 0, -weight, 0, 0, 0])
    return am.FrictionProblem.from_global(
        sparse.eye_array(6).tocsc(), H, f, np.zeros((len(legs), 3)), np.full(len(legs), mu)
    )


def masonry(rows, height, mu):
    """Courses of blocks, each a list of their ends (left, right), pushed like a column."""
    blocks, joints, below = [], [], []
    for k, row in enumerate(rows):
        y, here = k * height, []
        for left, right in row:
            number = len(blocks)
            blocks.append(np.array([[left, y], [right, y], [right, y + height],
                                    [left, y + height]]))  # fmt: skip
            for other, low, high in below if k else [(-1, left, right)]:
                ends = max(left, low), min(right, high)
                if ends[1] - ends[0] > 1e-9:
                    bed = tuple(np.array([x, y]) for x in ends)
                    joints.append((number, other, bed, (0.0, 1.0)))
            if here and abs(here[-1][2] - left) < 1e-9:
                head = np.array([left, y]), np.array([left, y + height])
                joints.append((number, here[-1][0], head, (1.0, 0.0)))
            here.append((number, left, right))
        below = here
    return assembly(blocks, joints, mu, sideways)


def running_bond(rows, blocks, length, height, mu, halves=True):
    """A wall of `masonry`; halves: half blocks at the ends of the first, third, ... course."""
    whole = [k * length for k in range(blocks + 1)]
    half = [0.0, *(x + length / 2 for x in whole[:-1]), whole[-1]]
    courses = [half if (k % 2 == 0) == halves else whole for k in range(rows)]
    return masonry([list(zip(x[:-1], x[1:], strict=True)) for x in courses], height, mu)


def groove(seed):
    """A block in a groove of two planes, pushed by a force somewhere."""
    random = np.random.default_rng(seed)
    a, b = random.uniform(0.1, 1.2, 2)
    mu = random.uniform(0.2, 1.0)
    left, right = np.array([-np.cos(a), np.sin(a)]), np.array([np.cos(b), np.sin(b)])
    block = np.array([[0.0, 0.0], right, right + [-0.3, 0.8], left + [0.3, 0.8], left])
    joints = [(0, -1, (0.2 * left, left), (np.sin(a), np.cos(a))),
              (0, -1, (0.2 * right, right), (-np.sin(b), np.cos(b)))]  # fmt: skip
    force, point = random.standard_normal(2), random.uniform(-0.5, 0.5, 2) + [0, 0.5]
    return assembly([block], joints, mu, lambda k, centre, area: (tuple(force * area), point))
