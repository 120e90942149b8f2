// The picture: samples are added up, and their means are shown.

/** Inferno-like stops of the colour map of steps (after the map of Smith and van der Walt, 2015), sRGB. */
const STOPS = [
    [0.001, 0.0, 0.014],
    [0.122, 0.047, 0.283],
    [0.333, 0.059, 0.428],
    [0.533, 0.135, 0.415],
    [0.73, 0.212, 0.333],
    [0.89, 0.35, 0.199],
    [0.977, 0.554, 0.035],
    [0.975, 0.789, 0.241],
    [0.988, 0.998, 0.645],
];

/** sRGB of linear values from 0 to 1 in steps of 1/4096. */
const SRGB = Uint8Array.from({ length: 4097 }, (_, i) => {
    const x = i / 4096;
    return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
});

/** The colour of a share from 0 to 1 in the colour map, bytes. */
function mapped(share) {
    const at = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1);
    const i = Math.min(Math.floor(at), STOPS.length - 2);
    return STOPS[i].map((low, k) => Math.round(255 * (low + (STOPS[i + 1][k] - low) * (at - i))));
}

export class Picture {
    #context;
    #image;
    #sums;
    #counts;

    constructor(canvas, width, height) {
        canvas.width = width;
        canvas.height = height;
        this.width = width;
        this.height = height;
        this.#context = canvas.getContext("2d");
        this.#image = this.#context.createImageData(width, height);
        // As many samples as the address of the page asks for, which no type with fewer bits counts and adds up.
        this.#sums = new Float64Array(3 * width * height);
        this.#counts = new Uint32Array(width * height);
        /** Steps that have the last colour of the map. */
        this.mostSteps = 1;
    }

    /** Forgets all samples; what is shown stays until there are others. */
    restart() {
        this.#sums.fill(0);
        this.#counts.fill(0);
        this.mostSteps = 1;
    }

    /** Shows a coarse tile: each of its pixels covers `step` by `step` pixels of the picture. */
    showCoarse({ mode, tile, step }, colors) {
        if (mode === "steps") for (let i = 0; i < colors.length; i += 3) this.mostSteps = Math.max(this.mostSteps, colors[i]);
        for (let y = 0; y < tile.height * step && tile.top + y < this.height; y++) {
            for (let x = 0; x < tile.width * step && tile.left + x < this.width; x++) {
                const from = 3 * (Math.floor(y / step) * tile.width + Math.floor(x / step));
                this.#set((tile.top + y) * this.width + tile.left + x, mode, colors, from, 1);
            }
        }
        this.#put(tile, step);
    }

    /** Adds a tile of samples, and shows the means. */
    add({ mode, tile }, colors) {
        for (let y = 0; y < tile.height; y++) {
            for (let x = 0; x < tile.width; x++) {
                const from = 3 * (y * tile.width + x), pixel = (tile.top + y) * this.width + tile.left + x;
                for (let k = 0; k < 3; k++) this.#sums[3 * pixel + k] += colors[from + k];
                this.#set(pixel, mode, this.#sums, 3 * pixel, ++this.#counts[pixel]);
            }
        }
        this.#put(tile, 1);
    }

    #set(pixel, mode, values, from, count) {
        const to = this.#image.data;
        if (mode === "steps") {
            to.set(mapped(values[from] / count / this.mostSteps), 4 * pixel);
        } else {
            for (let k = 0; k < 3; k++) {
                const value = Math.min(Math.max(values[from + k] / count, 0), 1);
                to[4 * pixel + k] = mode === "normals" ? Math.round(255 * value) : SRGB[Math.round(4096 * value)];
            }
        }
        to[4 * pixel + 3] = 255;
    }

    #put({ left, top, width, height }, step) {
        this.#context.putImageData(this.#image, 0, 0, left, top, width * step, height * step);
    }
}
