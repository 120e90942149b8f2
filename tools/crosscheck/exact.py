"""Whether two triangles are in bad contact, in exact rational arithmetic: a slow, simple reference.

The common part of two triangles is one of them clipped by the other. It is a convex polygon,
segment or point; the contact is harmless if that is nothing but the vertex or edge they share.
"""

from fractions import Fraction


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def rational(triangle):
    """The corners of a triangle of floats, exactly."""
    return [tuple(Fraction(float(x)) for x in p) for p in triangle]


def has_area(triangle):
    a, b, c = rational(triangle)
    return any(cross(minus(b, a), minus(c, a)))


def clip(polygon, normal, origin):
    """The corners of the part of a convex polygon where normal . (x - origin) >= 0."""
    kept = []
    heights = [dot(normal, minus(p, origin)) for p in polygon]
    for i, p in enumerate(polygon):
        q, hp, hq = polygon[(i + 1) % len(polygon)], heights[i], heights[(i + 1) % len(polygon)]
        if hp >= 0:
            kept.append(p)
        if hp * hq < 0:
            f = hp / (hp - hq)
            kept.append(tuple(x + f * (y - x) for x, y in zip(p, q)))
    return kept


def common_part(a, b):
    """Corners of the convex hull of the points that two rational triangles share."""
    normal = cross(minus(b[1], b[0]), minus(b[2], b[0]))
    polygon = clip(a, normal, b[0])
    polygon = clip(polygon, tuple(-x for x in normal), b[0])
    for k in range(3):
        polygon = clip(polygon, cross(normal, minus(b[(k + 1) % 3], b[k])), b[k])
    return polygon


def in_bad_contact(first, second):
    """Whether two triangles of non-zero area touch beyond the vertices that they share."""
    a, b = rational(first), rational(second)
    shared = [p for p in a if p in b]
    common = common_part(a, b)
    if len(shared) == 0:
        return bool(common)
    if len(shared) == 1:
        return any(p != shared[0] for p in common)
    if len(shared) == 2:
        edge = minus(shared[1], shared[0])
        return any(any(cross(edge, minus(p, shared[0]))) for p in common)
    return True
