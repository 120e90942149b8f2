// What queries answer: an array for each number, with one element for each ray or point.

/** Hits, an array for each of their numbers. */
export class Hits {
    constructor(count, numbers = Float32Array) {
        this.count = count;
        this.t = new numbers(count);
        this.u = new numbers(count);
        this.v = new numbers(count);
        this.instance = new Uint32Array(count);
        this.triangle = new Uint32Array(count);
    }
}

export class Closest {
    constructor(count) {
        this.count = count;
        this.distance = new Float64Array(count);
        this.point = new Float64Array(3 * count);
        this.u = new Float64Array(count);
        this.v = new Float64Array(count);
        this.instance = new Uint32Array(count);
        this.triangle = new Uint32Array(count);
        this.feature = new Uint32Array(count);
    }
}

export class Steps {
    constructor(count) {
        this.count = count;
        this.nodes = new Uint32Array(count);
        this.leaves = new Uint32Array(count);
        this.triangles = new Uint32Array(count);
        this.tets = new Uint32Array(count);
    }
}

export class Surface {
    constructor(count, numbers) {
        this.count = count;
        this.position = new numbers(3 * count);
        this.normal = new Float32Array(3 * count);
        this.geometricNormal = new Float32Array(3 * count);
        this.uv = new Float32Array(2 * count);
        this.color = new Float32Array(4 * count);
        this.secondUv = new Float32Array(2 * count);
        this.object = new Uint32Array(count);
        this.group = new Uint32Array(count);
        this.material = new Uint32Array(count);
    }
}
