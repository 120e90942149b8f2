// The viewer in a headless Chromium, opened as a file: drop, modes, orbit, damaged files, and pictures beside those of before.
//
//   DIST=FOLDER BTHC=PROGRAM BTH_SCENES=PROGRAM CHROMIUM=PROGRAM node --test viewer.test.mjs
//
// With BTH_BLESS=1 the pictures are written to expected/ in place of compared; look at them.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, truncateSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, dirname, join, resolve } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { Browser } from "./browser.mjs";
import { quads } from "./models.mjs";

const here = dirname(fileURLToPath(import.meta.url)), valid = resolve(here, "../../../format-spec/conformance/valid");
const { BTHC, BTH_SCENES, CHROMIUM } = process.env;
const WIDTH = 320, HEIGHT = 240;
/** Greatest difference of the means of a square of 16 pixels, of 255: what other compilers of sines make of the same samples. */
const MOST = 2;

let folder, browser, model;
before(async () => {
    folder = mkdtempSync(join(tmpdir(), "bth-viewer-"));
    const source = join(folder, "knot.ply");
    model = join(folder, "knot.bth");
    execFileSync(BTH_SCENES, ["make", "torus-knot", "-o", source]);
    execFileSync(BTHC, ["compile", source, "-o", model, "--quality", "fast", "--quiet"]);
    browser = await Browser.start(CHROMIUM, WIDTH, HEIGHT);
    // Without a network.
    await browser.send("Network.emulateNetworkConditions", { offline: true, latency: 0, downloadThroughput: -1, uploadThroughput: -1 });
    await browser.open(`${pathToFileURL(join(resolve(process.env.DIST), "viewer.html")).href}?samples=4`);
    await browser.until("!!window.viewer");
});
after(async () => {
    await browser?.end();
    rmSync(folder, { recursive: true });
});

/** Greatest difference of the means of squares of two pictures (PNG, base64), computed in the page. */
const difference = (a, b) => browser.value(`(async () => {
    const means = await Promise.all(["${a}", "${b}"].map(async (png) => {
        const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(png), (c) => c.charCodeAt(0))], { type: "image/png" }));
        const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
        context.drawImage(bitmap, 0, 0);
        const { data, width, height } = context.getImageData(0, 0, bitmap.width, bitmap.height);
        const sums = new Float64Array(3 * Math.ceil(width / 16) * Math.ceil(height / 16));
        for (let i = 0; i < width * height; i++) {
            const square = Math.floor(i / width / 16) * Math.ceil(width / 16) + Math.floor((i % width) / 16);
            for (let k = 0; k < 3; k++) sums[3 * square + k] += data[4 * i + k] / 256;
        }
        return sums;
    }));
    if (means[0].length !== means[1].length) return Infinity;
    return Math.max(...means[0].map((x, i) => Math.abs(x - means[1][i])));
})()`);

/** A screenshot without the words on the page, whose fonts and times differ. */
async function picture() {
    await browser.value("viewer.whenSettled()");
    await browser.value(`document.querySelectorAll("#bar, #status").forEach((e) => (e.style.visibility = "hidden"))`);
    const png = await browser.screenshot();
    await browser.value(`document.querySelectorAll("#bar, #status").forEach((e) => (e.style.visibility = ""))`);
    return png;
}

async function looksAs(name) {
    const png = await picture(), path = join(here, "expected", `${name}.png`);
    if (process.env.BTH_BLESS) return writeFileSync(path, Buffer.from(png, "base64"));
    const found = await difference(png, readFileSync(path, "base64"));
    if (found > MOST) writeFileSync(join(tmpdir(), `bth-viewer-${name}.png`), Buffer.from(png, "base64"));
    assert.ok(found <= MOST, `${name} differs by ${found} from ${path}; it is in ${tmpdir()}`);
}

test("a dropped file is shown", async () => {
    assert.match(await browser.value("document.getElementById('message').textContent"), /Drop a .bth file or a model/);
    await browser.drop(model, WIDTH / 2, HEIGHT / 2);
    await browser.until("/4 of 4 samples/.test(document.getElementById('status').textContent)");
    assert.match(await browser.value("document.getElementById('status').textContent"), /^knot\.bth · 2,880 triangles .* workers?$/);
    await looksAs("shaded");
});

test("materials are shown with their textures and holes", async () => {
    const [source, file, broken] = ["quads.gltf", "quads.bth", "broken.bth"].map((name) => join(folder, name));
    writeFileSync(source, quads());
    execFileSync(BTHC, ["compile", source, "-o", file, "--materials", "--quiet"]);
    await browser.drop(file, WIDTH / 2, HEIGHT / 2);
    await browser.until("/^quads.bth .*4 of 4 samples/.test(document.getElementById('status').textContent)");
    await looksAs("textures");
    // An image that only looks like one.
    const document = JSON.parse(quads());
    const image = Buffer.from(document.images[0].uri.split(",")[1], "base64");
    document.images[0].uri = `data:image/png;base64,${image.subarray(0, 60).toString("base64")}`;
    writeFileSync(source, JSON.stringify(document));
    execFileSync(BTHC, ["compile", source, "-o", broken, "--materials", "--quiet"]);
    // Of several files the first is shown, which is said.
    await browser.drop([broken, model], WIDTH / 2, HEIGHT / 2);
    await browser.until("/^broken.bth .the first of 2 files. .*4 of 4 samples .* 1 image the browser cannot decode/.test(document.getElementById('status').textContent)");
    await browser.drop(model, WIDTH / 2, HEIGHT / 2);
    await browser.until("/^knot.bth .*4 of 4 samples/.test(document.getElementById('status').textContent)");
});

test("models are compiled in the page and look as when bthc compiles them", async () => {
    const [binary, text] = ["quads.glb", "quads.gltf"].map((name) => join(folder, name));
    const json = Buffer.from(quads().padEnd(Math.ceil(quads().length / 4) * 4)), head = Buffer.alloc(20);
    [0x46546c67, 2, 20 + json.length, json.length, 0x4e4f534a].forEach((word, i) => head.writeUInt32LE(word, 4 * i));
    writeFileSync(binary, Buffer.concat([head, json]));
    writeFileSync(text, quads());
    for (const file of [binary, text]) {
        await browser.drop(file, WIDTH / 2, HEIGHT / 2);
        await browser.until(`document.getElementById('status').textContent.startsWith("${basename(file)} ")`);
        await looksAs("textures");
    }
    const meshes = { obj: "mtllib absent.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n", off: "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n" };
    meshes.stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
    for (const [extension, model] of Object.entries(meshes)) {
        const file = join(folder, `one.${extension}`);
        writeFileSync(file, model);
        await browser.drop(file, WIDTH / 2, HEIGHT / 2);
        const warning = extension === "obj" ? "2 warnings: .*absent.mtl.*left out" : "workers?$";
        await browser.until(`/^one.${extension} · 1 triangle .*4 of 4 samples .*${warning}/.test(document.getElementById('status').textContent)`);
    }
    await browser.drop(join(folder, "knot.ply"), WIDTH / 2, HEIGHT / 2);
    await browser.until("/^knot.ply · 2,880 triangles .*4 of 4 samples/.test(document.getElementById('status').textContent)");
    await looksAs("shaded");
    const broken = join(folder, "broken.ply");
    writeFileSync(broken, "ply\nformat ascii 1.0\nelement vertex 3\n");
    await browser.drop(broken, WIDTH / 2, HEIGHT / 2);
    await browser.until("/^broken.ply: .*BTH-I/.test(document.getElementById('message').textContent)");
    await hidesMessage();
    await browser.drop(model, WIDTH / 2, HEIGHT / 2);
    await browser.until("/^knot.bth .*4 of 4 samples/.test(document.getElementById('status').textContent)");
});

for (const [key, mode] of [["2", "normals"], ["3", "ao"], ["4", "steps"]]) {
    test(`mode ${mode}`, async () => {
        for (const type of ["keyDown", "keyUp"]) await browser.send("Input.dispatchKeyEvent", { type, key, text: type === "keyDown" ? key : undefined });
        assert.equal(await browser.value(`document.querySelector("[data-mode=${mode}]").getAttribute("aria-pressed")`), "true");
        await looksAs(mode);
    });
}

test("dragging turns the model, and Reset view brings it back", async () => {
    await browser.value(`viewer.setMode("normals")`);
    const before = await picture();
    await browser.mouse("mousePressed", 100, 150);
    for (let x = 100; x <= 200; x += 20) await browser.mouse("mouseMoved", x, 150);
    await browser.mouse("mouseReleased", 200, 150);
    assert.ok((await difference(before, await picture())) > 20);
    await browser.value(`document.getElementById("reset").click()`);
    assert.ok((await difference(before, await picture())) <= MOST);
});

test("keys turn, move and zoom, and turn back", async () => {
    const press = (key, modifiers = "") => browser.value(`dispatchEvent(new KeyboardEvent("keydown", { key: "${key}"${modifiers} }))`);
    const before = await picture();
    for (const [there, back, modifiers] of [
        ["ArrowLeft", "ArrowRight"], ["ArrowDown", "ArrowUp"], ["ArrowUp", "ArrowDown", ", shiftKey: true"], ["+", "-"],
    ]) {
        await press(there, modifiers);
        assert.ok((await difference(before, await picture())) > 5, there);
        await press(back, modifiers);
        assert.ok((await difference(before, await picture())) <= MOST, back);
    }
});

test("a double click shows what is at that point, until the view is reset", async () => {
    const status = "document.getElementById('status').textContent";
    for (let clickCount = 1; clickCount <= 2; clickCount++) {
        for (const type of ["mousePressed", "mouseReleased"]) await browser.mouse(type, 175, 120, { clickCount });
    }
    await browser.until(`/ · instance 0, triangle \\d+, t [\\d.]+$/.test(${status})`);
    await browser.until(`/^knot.bth · .*4 of 4 samples .* · instance 0, triangle \\d+, t [\\d.]+$/.test(${status})`);
    await browser.value(`document.getElementById("reset").click()`);
    await browser.until(`/4 of 4 samples .* workers?$/.test(${status})`);
});

test("a damaged file is refused with its code, and the model stays", async () => {
    const before = await picture(), damaged = join(folder, "damaged.bth");
    const bytes = readFileSync(model);
    bytes[0] ^= 1;
    writeFileSync(damaged, bytes);
    await browser.drop(damaged, WIDTH / 2, HEIGHT / 2);
    await browser.until("/damaged.bth: .*BTH-F002/.test(document.getElementById('message').textContent)");
    await hidesMessage();
    assert.ok((await difference(before, await picture())) <= MOST);
});

/** What the page says in its middle. */
const message = () => browser.value(`(({ hidden, textContent }) => (hidden ? "" : textContent))(document.getElementById("message"))`);

/** Does what hides the message of something that failed: a press of the pointer, or of a key that has no meaning. */
async function hidesMessage(key) {
    assert.notEqual(await message(), "");
    if (key) {
        for (const type of ["keyDown", "keyUp"]) await browser.send("Input.dispatchKeyEvent", { type, key });
    } else {
        for (const type of ["mousePressed", "mouseReleased"]) await browser.mouse(type, 100, 150);
    }
    assert.equal(await message(), "");
}

test("a file with nothing to see is refused, and the model stays and can be turned", async () => {
    const before = await picture();
    await browser.drop(join(valid, "no-objects.bth"), WIDTH / 2, HEIGHT / 2);
    await browser.until("/no-objects.bth: there is nothing to see/.test(document.getElementById('message').textContent)");
    await hidesMessage("Shift");
    assert.match(await browser.value("document.getElementById('status').textContent"), /^knot\.bth/);
    await browser.mouse("mousePressed", 100, 150);
    await browser.mouse("mouseMoved", 200, 150);
    await browser.mouse("mouseReleased", 200, 150);
    assert.ok((await difference(before, await picture())) > 20);
    await browser.value(`document.getElementById("reset").click()`);
    assert.ok((await difference(before, await picture())) <= MOST);
});

test("a folder is refused, and the model stays", async () => {
    const before = await picture(), dropped = join(folder, "a folder");
    mkdirSync(dropped);
    await browser.drop(dropped, WIDTH / 2, HEIGHT / 2);
    await browser.until("/a folder: this is a folder, or a file that cannot be read/.test(document.getElementById('message').textContent)");
    await hidesMessage();
    assert.ok((await difference(before, await picture())) <= MOST);
});

test("a file that is chosen again is opened again", async () => {
    const chosen = join(folder, "chosen.bth");
    const { root } = await browser.send("DOM.getDocument");
    const { nodeId } = await browser.send("DOM.querySelector", { nodeId: root.nodeId, selector: "#file" });
    for (const [bytes, said] of [["", /^chosen.bth: BTH-F001/], [readFileSync(join(valid, "triangle.bth")), /^$/]]) {
        writeFileSync(chosen, bytes);
        await browser.send("DOM.setFileInputFiles", { nodeId, files: [chosen] });
        assert.equal(await browser.value("document.getElementById('file').value"), "");
        await browser.until(`${said}.test(((m) => (m.hidden ? "" : m.textContent))(document.getElementById("message")))`);
    }
    await browser.until("/^chosen.bth · 1 triangle ·/.test(document.getElementById('status').textContent)");
});

test("a file that is too large for the browser is refused with its size", async () => {
    const large = join(folder, "large.bth");
    writeFileSync(large, "");
    // It takes no room on the disk.
    truncateSync(large, 2.5 * 2 ** 30);
    await browser.drop(large, WIDTH / 2, HEIGHT / 2);
    await browser.until("/large.bth: the browser cannot read files of 2 GiB .* 2.5 GiB; bth-play/.test(document.getElementById('message').textContent)");
    await hidesMessage();
});

test("of two files that are opened at a time the later is shown", async () => {
    const [large, small] = [model, join(valid, "triangle.bth")].map((path) => readFileSync(path, "base64"));
    const status = await browser.value(`(async () => {
        const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
        // Workers of the older open it slowly, as they do a large file.
        const { Worker } = window;
        window.Worker = class extends Worker {
            postMessage(request, transfer) {
                setTimeout(() => super.postMessage(request, transfer), 300);
            }
        };
        const older = viewer.open(bytes("${large}"), "older");
        await new Promise((resolve) => setTimeout(resolve, 100));
        window.Worker = Worker;
        // The bytes of another older one come late.
        const late = new Promise((resolve) => setTimeout(resolve, 900, bytes("${large}")));
        await Promise.all([older, viewer.open(late, "late"), viewer.open(bytes("${small}"), "newer")]);
        await viewer.whenSettled();
        return document.getElementById("status").textContent;
    })()`);
    assert.match(status, /^newer · 1 triangle ·/);
    assert.equal(await message(), "");
});

test("the status is never that of another file", async () => {
    const status = "document.getElementById('status').textContent";
    assert.match(await browser.value(status), /^newer/);
    // There is no picture yet when the file is open.
    const opened = await browser.value(`(async () => {
        await viewer.open(Uint8Array.from(atob("${readFileSync(model, "base64")}"), (c) => c.charCodeAt(0)).buffer, "another");
        return ${status};
    })()`);
    assert.equal(opened, "another");
    await browser.value("viewer.whenSettled()");
    assert.match(await browser.value(status), /^another · 2,880 triangles/);
});

test("a long name stays in the window", async () => {
    const wide = await browser.value(`(async () => {
        await viewer.open(Uint8Array.from(atob("${readFileSync(join(valid, "triangle.bth"), "base64")}"), (c) => c.charCodeAt(0)).buffer, "n".repeat(300));
        const { scrollWidth, clientWidth } = document.getElementById("status");
        return [scrollWidth, clientWidth];
    })()`);
    assert.ok(wide[0] <= wide[1], `${wide}`);
});

test("a scene that is empty at first is shown once there is something", async () => {
    await browser.drop(join(valid, "scene-moving.bth"), WIDTH / 2, HEIGHT / 2);
    await browser.until("document.getElementById('status').textContent === 'scene-moving.bth'");
    assert.match(await message(), /nothing to see in this frame/);
    const blank = await browser.screenshot();
    const slider = "document.getElementById('time')";
    assert.equal(await browser.value(`${slider}.parentElement.hidden`), false);
    const frame = "document.getElementById('frame').textContent";
    assert.equal(await browser.value(frame), "-3");
    // Neither a press nor a key breaks anything while there is no view.
    for (const type of ["mousePressed", "mouseReleased"]) await browser.mouse(type, 100, 150);
    for (const key of ["r", "u", "u"]) await browser.send("Input.dispatchKeyEvent", { type: "keyDown", key, text: key });
    await browser.value(`${slider}.value = ${slider}.max; ${slider}.dispatchEvent(new Event("input"))`);
    await browser.until("/^scene-moving.bth · .*4 of 4 samples/.test(document.getElementById('status').textContent)");
    assert.equal(await browser.value(frame), "60");
    assert.equal(await message(), "");
    assert.ok((await difference(blank, await picture())) > 20);
});

test("the first view of an upright window shows all of the model", async () => {
    await browser.drop(model, WIDTH / 2, HEIGHT / 2);
    await browser.until("/^knot.bth · .*4 of 4 samples/.test(document.getElementById('status').textContent)");
    await browser.resize(200, 500);
    await browser.until("innerWidth === 200");
    await browser.value(`document.getElementById("reset").click()`);
    await browser.value("viewer.whenSettled()");
    // In this mode nothing but the model differs from the corner of the picture.
    const [left, right] = await browser.value(`(() => {
        const { width, height } = document.getElementById("picture");
        const pixels = new Uint32Array(document.getElementById("picture").getContext("2d").getImageData(0, 0, width, height).data.buffer);
        const columns = Array.from({ length: width }, (_, x) => x).filter((x) => pixels.some((p, i) => i % width === x && p !== pixels[0]));
        return [columns[0], width - 1 - columns.at(-1)];
    })()`);
    assert.ok(left > 0 && right > 0 && left < 50 && right < 50, `${left} and ${right} pixels beside the model`);
    await browser.resize(WIDTH, HEIGHT);
});

test("the picture has the pixels of the screen that the window is moved to", async () => {
    for (const ratio of [1, 2, 1.5]) {
        await browser.resize(100, 80, ratio);
        // Without a screenshot the emulated screen shows nothing new, of which the page would be told.
        await browser.screenshot();
        await browser.until(`document.getElementById("picture").width === ${100 * ratio}`, 10);
    }
    await browser.resize(WIDTH, HEIGHT);
});

test("screen readers are told what the picture is of", async () => {
    const { root } = await browser.send("DOM.getDocument");
    const { nodeId } = await browser.send("DOM.querySelector", { nodeId: root.nodeId, selector: "canvas" });
    const { nodes } = await browser.send("Accessibility.getPartialAXTree", { nodeId, fetchRelatives: false });
    assert.equal(nodes[0].name.value, "Picture of knot.bth");
});

test("nothing was asked of a network, and no error was left unseen", () => {
    assert.deepEqual(browser.requests.filter((url) => !/^(blob|data):/.test(url)), []);
    assert.deepEqual(browser.complaints, []);
});

test("a page from a disk says that it cannot read other files", async () => {
    await browser.open(`${pathToFileURL(join(resolve(process.env.DIST), "viewer.html")).href}?file=knot.bth`);
    await browser.until(`/^knot.bth: pages that are opened from a disk .* drop it here/.test(document.getElementById("message")?.textContent)`, 10);
});
