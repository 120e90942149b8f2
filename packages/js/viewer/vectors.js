// Vectors of three numbers, and sample points.

export const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.sqrt(dot(a, a));
export const unit = (a) => scale(a, 1 / length(a));
export const blend = (a, b, part) => add(scale(a, 1 - part), b, part);

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

/**
 * A unit vector times `along`, plus a vector of length `away` that is perpendicular to it, turned around it by an angle. The two unit
 * vectors that span what is perpendicular are those of Duff et al. (2017); they stand in no arrays, since most of the time of a picture goes to these.
 */
export function tilted([x, y, z], away, along, turn) {
    const sign = z < 0 ? -1 : 1, a = -1 / (sign + z), b = x * y * a;
    const p = away * Math.cos(turn), q = away * Math.sin(turn);
    return [
        p * (1 + sign * x * x * a) + q * b + along * x,
        p * sign * b + q * (sign + y * y * a) + along * y,
        along * z - p * sign * x - q * y,
    ];
}

/** A unit direction around a unit normal, with a density proportional to the cosine of the angle to it. */
export const cosineDirection = (normal, [x, y]) => tilted(normal, Math.sqrt(x), Math.sqrt(1 - x), 2 * Math.PI * y);
