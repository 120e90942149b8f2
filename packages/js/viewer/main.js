// The page: opens files, turns the camera, and lets workers refine the picture while nothing changes.

import { cameraOf, contains, firstView, shifted, turned, zoomed, directionThrough } from "./camera.js";
import { Picture } from "./picture.js";
import { isModel } from "./models.js";
import { Pool, compileModel } from "./pool.js";
import { add, length } from "./vectors.js";

/** Pixels of a tile's side, and how many pixels of the picture one of a coarse picture covers. */
const TILE = 64, COARSE = 4;
/** What the address of the page asks for: `?file=URL`, where it is served, and `?samples=N`. */
const asked = new URLSearchParams(location.search);
/** Samples of a pixel after which the picture is done. */
const SAMPLES = { shaded: 64, normals: 16, ao: 64, steps: 4 };
const samplesFor = (mode) => Math.max(1, Math.floor(Number(asked.get("samples"))) || SAMPLES[mode]);

const element = (id) => document.getElementById(id);
const canvas = element("picture"), status = element("status"), message = element("message");

/** What is shown: the workers, what the file holds, the view, the mode, and what is known of the point that was last looked at. */
const shown = { pool: null, content: null, name: "", warnings: [], view: null, mode: "shaded", up: "y", picked: "" };
/** Grows with every change, so that work for an older state is dropped. */
let state = 0;
let picture = null;
let settled = false;
/** Functions that wait for the picture to be done. */
let waiting = [];
/** Number of the last file that was to be opened. */
let last = 0;
/** Whether the message is of something that failed, which the next action hides. */
let failed = false;

/**
 * Opens a file, of which there are the bytes or a promise of them; says what is wrong if it cannot be opened, and then keeps what was
 * shown. Of several files that are being opened, the last is shown.
 */
export async function open(file, name) {
    const number = ++last;
    say("Opening …");
    try {
        let bytes = await file, warnings = [];
        if (number !== last) return;
        if (isModel(name)) {
            say("Compiling …");
            ({ bytes, warnings } = await compileModel(workerUrl(), await compilerModule(), name, bytes));
            if (number !== last) return;
            for (const warning of warnings) console.warn(warning);
        }
        const opened = await Pool.open(workerUrl(), await compiledModule(), bytes);
        if (number !== last) return opened.pool.end();
        if (!opened.content.bounds && !isMoving(opened.content)) {
            opened.pool.end();
            throw new Error("there is nothing to see in this file");
        }
        shown.pool?.end();
        Object.assign(shown, opened, { name, warnings, view: null });
        showTime();
        // That of another file would stay until there is a sample of each pixel.
        status.textContent = name;
        canvas.setAttribute("aria-label", `Picture of ${name}`);
        reset();
        sayWhatIsSeen();
        if (!shown.view) {
            // The picture of another file would stay.
            canvas.getContext("2d").clearRect(0, 0, canvas.width, canvas.height);
        }
    } catch (error) {
        if (number === last) complain(`${name}: ${error.message}`);
        throw error;
    }
}

export function setMode(mode) {
    shown.mode = mode;
    for (const button of document.querySelectorAll("[data-mode]")) {
        button.setAttribute("aria-pressed", String(button.dataset.mode === mode));
    }
    changed();
}

/** Resolves when the picture has all its samples. */
export function whenSettled() {
    return settled ? Promise.resolve() : new Promise((resolve) => waiting.push(resolve));
}

function say(text) {
    failed = false;
    message.textContent = text || (shown.content ? "" : "Drop a .bth file or a model here");
    message.hidden = message.textContent === "";
}

/** Says what failed, until something else is done. */
function complain(text) {
    say(text);
    failed = true;
}

/** Says so where there was nothing to see yet. */
function sayWhatIsSeen() {
    say(shown.view ? "" : "There is nothing to see in this frame");
}

/** Shows the first view. There is none as long as there was nothing to see. */
function reset() {
    const { bounds } = shown.content, { width, height } = pixels();
    shown.view = bounds && firstView(bounds, shown.up, width / height);
    shown.picked = "";
    changed();
}

/** Starts the picture anew. */
function changed() {
    state++;
    settled = false;
    if (!shown.pool?.size || !shown.view) return;
    refine(state);
}

const diagonalOf = ({ lower, upper }) => length(add(upper, lower, -1));

/** Shows a coarse picture, then adds samples until there are enough or something changes. */
async function refine(of) {
    await new Promise(requestAnimationFrame);
    const stopped = () => of !== state;
    if (stopped()) return;
    const { width, height } = pixels();
    if (picture === null || picture.width !== width || picture.height !== height) picture = new Picture(canvas, width, height);
    const { bounds } = shown.content;
    const camera = cameraOf(shown.view, width / height);
    const common = {
        camera, bounds, mode: shown.mode, size: { width, height }, diagonal: diagonalOf(bounds), inside: contains(bounds, camera.eye),
    };
    const start = performance.now();
    try {
        let fresh = false;
        await shown.pool.work(jobs(common, COARSE, 0), stopped, (job, { picture: colors }) => {
            if (!fresh) picture.restart();
            fresh = true;
            picture.showCoarse(job, colors);
        });
        for (let sample = 0; sample < samplesFor(common.mode) && !stopped(); sample++) {
            await shown.pool.work(jobs(common, 1, sample), stopped, (job, { picture: colors }) => picture.add(job, colors));
            if (!stopped()) report(sample + 1, performance.now() - start, common);
        }
    } catch (error) {
        if (!stopped()) complain(error.message);
    }
    if (stopped()) return;
    settled = true;
    for (const resolve of waiting.splice(0)) resolve();
}

/** The tiles of a picture, from its middle outwards. */
function jobs(common, step, sample) {
    const { width, height } = common.size, side = TILE * step, list = [];
    for (let top = 0; top < height; top += side) {
        for (let left = 0; left < width; left += side) {
            const tile = {
                left, top,
                width: Math.ceil(Math.min(side, width - left) / step),
                height: Math.ceil(Math.min(side, height - top) / step),
            };
            const away = Math.hypot(left + side / 2 - width / 2, top + side / 2 - height / 2);
            list.push({ away, job: { ...common, tile, step, sample } });
        }
    }
    return list.sort((a, b) => a.away - b.away).map(({ job }) => job);
}

/** The size of the picture: that of the window, in pixels of the screen. */
function pixels() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    return { width: Math.max(1, Math.round(innerWidth * ratio)), height: Math.max(1, Math.round(innerHeight * ratio)) };
}

function report(samples, milliseconds, { mode, size }) {
    const { content, pool, name, warnings } = shown;
    const counted = (n, thing) => `${n.toLocaleString("en")} ${thing}${n === 1 ? "" : "s"}`;
    const rate = (samples * size.width * size.height) / milliseconds / 1000;
    const parts = [
        name,
        counted(content.triangles, "triangle"),
        content.instances > 1 ? counted(content.instances, "instance") : "",
        `${samples} of ${samplesFor(mode)} samples`,
        `${rate.toFixed(2)} million pixels a second`,
        counted(pool.size, "worker"),
        content.undecoded > 0 ? `${counted(content.undecoded, "image")} the browser cannot decode` : "",
        warnings.length > 0 ? `${counted(warnings.length, "warning")}: ${warnings[0]}` : "",
        mode === "steps" ? `brightest: ${counted(picture.mostSteps, "step")}` : "",
        shown.picked,
    ];
    status.textContent = parts.filter(Boolean).join(" · ");
}

const isMoving = ({ frames }) => frames !== null && frames.first !== frames.last;

/** Shows the slider of time for scenes of several frames. */
function showTime() {
    const { frames } = shown.content;
    const slider = element("time");
    slider.parentElement.hidden = !isMoving(shown.content);
    if (frames) Object.assign(slider, { min: frames.first, max: frames.last, value: frames.first, step: 1 });
    element("frame").textContent = slider.value;
}

async function setFrame(frame) {
    const { frames } = shown.content;
    element("frame").textContent = frame;
    state++;
    try {
        const { bounds } = await shown.pool.askAll("seconds", { seconds: frame / frames.rate });
        if (bounds) shown.content.bounds = bounds;
        // The view stays as it is, once there is one.
        if (!shown.view) reset();
        sayWhatIsSeen();
    } catch (error) {
        complain(error.message);
    }
    changed();
}

/** Looks from now on at what is under a point of the window. */
async function lookAt(x, y) {
    const camera = cameraOf(shown.view, innerWidth / innerHeight);
    const direction = directionThrough(camera, (2 * x) / innerWidth - 1, 1 - (2 * y) / innerHeight);
    const hit = await shown.pool.ask("pick", { ray: Float32Array.of(...camera.eye, 0, ...direction, Infinity) });
    if (hit.t === Infinity) return;
    shown.view = { ...shown.view, target: add(camera.eye, direction, hit.t) };
    shown.view.distance = hit.t;
    shown.picked = `instance ${hit.instance}, triangle ${hit.triangle}, t ${hit.t}`;
    status.textContent = `${shown.name} · ${shown.picked}`;
    changed();
}

// Files: dropped, chosen, or named in the address.
addEventListener("dragover", (event) => {
    event.preventDefault();
    document.body.classList.add("over");
});
addEventListener("dragleave", () => document.body.classList.remove("over"));
addEventListener("drop", (event) => {
    event.preventDefault();
    document.body.classList.remove("over");
    openFile(event.dataTransfer.files);
});
element("file").addEventListener("change", ({ target }) => {
    openFile(target.files);
    // Else the same file, which may have changed, would not be opened when it is chosen again.
    target.value = "";
});
/** Opens the first of the files that were chosen. `open` says what is wrong. */
function openFile([file, ...others]) {
    const name = others.length > 0 ? `${file.name} (the first of ${others.length + 1} files)` : file?.name;
    if (file) open(chosenBytes(file), name).catch(() => {});
}
/** The bytes of a file. Browsers hand over folders as files, too, which cannot be read, and have no buffers for files of 2 GiB and more. */
async function chosenBytes(file) {
    try {
        return await file.arrayBuffer();
    } catch (error) {
        const gib = file.size / 2 ** 30;
        if (gib >= 2) throw new Error(`the browser cannot read files of 2 GiB and more at once, and this one has ${gib.toFixed(1)} GiB; bth-play shows it`);
        throw new Error(`this is a folder, or a file that cannot be read (${error.message})`);
    }
}
async function fetchedBytes(url) {
    const response = await fetch(url).catch((error) => {
        if (location.protocol !== "file:") throw error;
        throw new Error("pages that are opened from a disk can read no other files; drop it here, or open the page from a server");
    });
    if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
    return response.arrayBuffer();
}
say("");
const named = asked.get("file");
if (named) open(fetchedBytes(named), named.split("/").pop()).catch(() => {});

// What failed was read when something else is done.
for (const action of ["pointerdown", "keydown"]) addEventListener(action, () => failed && say(""), { capture: true });

// The pointer: one button turns, the other or Shift shifts, two fingers zoom and shift, the wheel zooms.
const pointers = new Map();
canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
});
canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before || !shown.view) return;
    const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
    if (pointers.size === 2) {
        const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
        const apart = (at) => Math.hypot(at.clientX - other.clientX, at.clientY - other.clientY);
        shown.view = zoomed(shifted(shown.view, -dx / innerHeight / 2, dy / innerHeight / 2), apart(before) / Math.max(apart(event), 1));
    } else if (event.shiftKey || event.buttons !== 1) {
        shown.view = shifted(shown.view, -dx / innerHeight, dy / innerHeight);
    } else {
        shown.view = turned(shown.view, (-4 * dx) / innerHeight, (4 * dy) / innerHeight);
    }
    pointers.set(event.pointerId, event);
    changed();
});
for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("dblclick", (event) => shown.view && lookAt(event.clientX, event.clientY));
canvas.addEventListener(
    "wheel",
    (event) => {
        event.preventDefault();
        if (shown.view) shown.view = zoomed(shown.view, Math.exp(event.deltaY * 0.001));
        changed();
    },
    { passive: false },
);

// Buttons and keys.
for (const button of document.querySelectorAll("[data-mode]")) {
    button.addEventListener("click", () => setMode(button.dataset.mode));
}
const actions = {
    1: () => setMode("shaded"),
    2: () => setMode("normals"),
    3: () => setMode("ao"),
    4: () => setMode("steps"),
    u: () => {
        shown.up = shown.up === "y" ? "z" : "y";
        if (shown.content) reset();
    },
    r: () => shown.content && reset(),
};
/** Which way arrow keys drag the model: to the right and down. */
const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** The view after a key: arrows drag the model as the pointer does, 24 to a whole turn, with Shift a twentieth of the picture; + and - zoom. */
function viewAfter(view, { key, shiftKey }) {
    if (key in arrows) {
        const [right, down] = arrows[key];
        return shiftKey ? shifted(view, -right / 20, down / 20) : turned(view, (-Math.PI / 12) * right, (Math.PI / 12) * down);
    }
    if (key === "+" || key === "=") return zoomed(view, 0.8);
    return key === "-" ? zoomed(view, 1 / 0.8) : view;
}
addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    actions[event.key.toLowerCase()]?.();
    // Arrows move the slider while it has the focus.
    if (!shown.view || event.target === element("time")) return;
    const view = viewAfter(shown.view, event);
    if (view === shown.view) return;
    event.preventDefault();
    shown.view = view;
    changed();
});
element("up").addEventListener("click", actions.u);
element("reset").addEventListener("click", actions.r);
element("time").addEventListener("input", (event) => setFrame(Number(event.target.value)));
addEventListener("resize", changed);
/** Follows the pixels of the screen: a window that is moved to a finer one keeps its size. */
function followScreen() {
    const changes = matchMedia(`(resolution: ${window.devicePixelRatio}dppx)`);
    changes.addEventListener("change", () => (changed(), followScreen()), { once: true });
}
followScreen();

// For tests, and for pages that show a file of their own.
window.viewer = { open, setMode, whenSettled };
