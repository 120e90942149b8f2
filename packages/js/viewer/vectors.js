// Vectors of three numbers, and sample points.

export const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.sqrt(dot(a, a));
export const unit = (a) => scale(a, 1 / length(a));
export const blend = (a, b, part) => add(scale(a, 1 - part), b, part);

/** Two unit vectors that are perpendicular to a unit vector and to each other (Duff et al., 2017). */
export function perpendicular([x, y, z]) {
    const sign = z < 0 ? -1 : 1;
    const a = -1 / (sign + z), b = x * y * a;
    return [[1 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]];
}

/** A hash of 32 bits (lowbias32 of Wellons, 2018). */
export function mix(x) {
    x = Math.imul(x ^ (x >>> 16), 0x7feb352d);
    x = Math.imul(x ^ (x >>> 15), 0x846ca68b);
    return (x ^ (x >>> 16)) >>> 0;
}

/**
 * Point `index` in the unit square of a pixel's sequence for a dimension: the R2 sequence of Roberts ("The unreasonable effectiveness
 * of quasirandom sequences", 2018), shifted by a hash. A picture is the same on every run and with any number of workers.
 */
export function samplePoint(pixel, dimension, index) {
    const shift = mix(pixel ^ mix(dimension + 1));
    const x = shift / 2 ** 32 + 0.7548776662466927 * index, y = mix(shift) / 2 ** 32 + 0.5698402909980533 * index;
    return [x - Math.floor(x), y - Math.floor(y)];
}

/** A unit direction around a unit normal, with a density proportional to the cosine of the angle to it. */
export function cosineDirection(normal, [x, y]) {
    const [tangent, bitangent] = perpendicular(normal);
    const radius = Math.sqrt(x), angle = 2 * Math.PI * y;
    const flat = add(scale(tangent, radius * Math.cos(angle)), bitangent, radius * Math.sin(angle));
    return add(flat, normal, Math.sqrt(1 - x));
}
