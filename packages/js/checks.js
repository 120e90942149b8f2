// Checks of arguments, and errors that say what was expected.

/** Bytes of a file at most: the module holds it in one piece, at a multiple of 64. */
const MOST_FILE = 2 ** 31 - 64;
/** Numbers of a ray: origin, tmin, direction, tmax. In double they take two words each. */
export const RAY = 8;
/** Numbers of a point. */
export const POINT = 3;
/** What arrays hold, by the numbers of each. */
const ROWS = { [RAY]: "eight numbers a ray (origin, tmin, direction, tmax)", [POINT]: "three numbers a point", 16: "16 numbers a matrix, column by column" };
/** Columns of hits: the first three are numbers, the others indices. */
export const HIT_NAMES = ["t", "u", "v", "instance", "triangle"];

/** What the library refuses: `code` is that of the error, such as "BTH-F001", or "" where it has none. */
export class BthError extends Error {
    constructor(message, options) {
        super(message, options);
        this.name = "BthError";
        this.code = /BTH-[A-Z]\d+/.exec(message)?.[0] ?? "";
    }
}

/** What an argument is, for errors. */
export function kindOf(value) {
    return value?.constructor?.name ?? String(value);
}

/** What an argument is, with its length where it is an array. */
export function sizedKindOf(value) {
    if (classOf(value) === "DataView") return `DataView of ${value.byteLength} bytes`;
    return ArrayBuffer.isView(value) || Array.isArray(value) ? `${kindOf(value)} of ${value.length}` : kindOf(value);
}

/** The built-in class of a value, such as "Float32Array". Objects of other windows are instances of other classes of this name. */
export function classOf(value) {
    return Object.prototype.toString.call(value).slice(8, -1);
}

/** The bytes of a file, which come as a buffer or as a view of one. */
export function bytesOf(file) {
    const isView = ArrayBuffer.isView(file);
    if (!isView && !/^(Shared)?ArrayBuffer$/.test(classOf(file))) {
        const hint = typeof file?.then === "function" ? ": await it" : typeof file?.arrayBuffer === "function" ? ": await its arrayBuffer()" : "";
        throw new TypeError(`file: expected an ArrayBuffer or a view of one, with the bytes of a file; found ${kindOf(file)}${hint}`);
    }
    if (file.byteLength > MOST_FILE) {
        throw new BthError(`BTH-O001: expected a file of less than 2 GiB, which a module can hold in one piece; found ${file.byteLength} bytes`);
    }
    return isView ? new Uint8Array(file.buffer, file.byteOffset, file.byteLength) : new Uint8Array(file);
}

/** Refuses what is no index below a number. */
export function checkIndex(name, index, count) {
    if (Number.isInteger(index) && index >= 0 && index < count) return;
    throw new RangeError(`${name}: expected an index below ${count}; found ${typeof index === "number" ? index : kindOf(index)}`);
}

/** The class of the numbers of rays or hits: Float64Array where the caller has that, else Float32Array. */
export function numbersOf(array) {
    return classOf(array) === "Float64Array" ? Float64Array : Float32Array;
}

/** Number of rays or points of so many numbers in an array, which is of one of these classes. */
export function countOf(given, width, ...classes) {
    const [[name, array]] = Object.entries(given);
    if (!classes.includes(classOf(array)) || array.length % width !== 0) {
        throw new TypeError(`${name}: expected a ${classes.join(" or ")} of ${ROWS[width]}; found ${sizedKindOf(array)}`);
    }
    if (array.length === 0 && isDetached(array.buffer)) throw new TypeError(`${name}: their buffer is detached; it was transferred`);
    return array.length / width;
}

/** A function that copies `n` rays, or points, from an index on to the module. */
export function copied(rays, width = RAY) {
    return (to, from, n) => to.set(rays.subarray(from * width, (from + n) * width));
}

/** The same for rays that start on surfaces: instance, triangle, u, v, direction, tmax. */
export function startsCopied({ instance, triangle, u, v }, directions, tmax) {
    return (to, from, n) => {
        const indices = new Uint32Array(to.buffer, to.byteOffset, to.length);
        for (let i = 0; i < n; i++) {
            const at = RAY * i, ray = from + i;
            indices[at] = instance[ray];
            indices[at + 1] = triangle[ray];
            to[at + 2] = u[ray];
            to[at + 3] = v[ray];
            for (let k = 0; k < 3; k++) to[at + 4 + k] = directions[3 * ray + k];
            to[at + 7] = typeof tmax === "number" ? tmax : tmax[ray];
        }
    };
}

/** Number of rays that start on surfaces. */
export function countOfStarts(starts, directions, tmax) {
    const count = starts?.count;
    if (count === undefined) throw new TypeError(`starts: expected hits, or their columns instance, triangle, u, v and count; found ${kindOf(starts)}`);
    for (const name of ["u", "v", "instance", "triangle"]) {
        const of = name.length === 1 ? numbersOf(starts.u).name : "Uint32Array";
        checkColumn(`starts.${name}`, starts[name], of, count);
    }
    checkColumn("directions", directions, "Float32Array", 3 * count, "three numbers a ray");
    if (typeof tmax !== "number") checkColumn("tmax", tmax, "Float32Array", count, "or a number for all rays");
    return count;
}

/** Refuses what is no typed array of this class and length. */
export function checkColumn(name, column, of, length, what = "as many as there are rays") {
    if (classOf(column) === of && column.length === length) return;
    throw new TypeError(`${name}: expected a ${of} of ${length} elements, ${what}; found ${sizedKindOf(column)}`);
}

/** Whether a buffer was transferred, for example to a worker. `detached` is younger than some of the supported programs. */
export function isDetached(buffer) {
    try {
        new Uint8Array(buffer);
        return false;
    } catch {
        return true;
    }
}

/** Refuses hits whose columns are not those of their number of rays. */
export function checkHits(hits) {
    if (hits?.count === undefined) throw new TypeError(`hits: expected the answer of nearest; found ${kindOf(hits)}`);
    HIT_NAMES.forEach((name, k) => checkColumn(`hits.${name}`, hits[name], k < 3 ? numbersOf(hits.t).name : "Uint32Array", hits.count));
}

