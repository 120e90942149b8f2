// The viewer in a headless Chromium, opened as a file: drop, modes, orbit, damaged files, and pictures beside those of before.
//
//   DIST=FOLDER BTHC=PROGRAM BTH_SCENES=PROGRAM CHROMIUM=PROGRAM node --test viewer.test.mjs
//
// With BTH_BLESS=1 the pictures are written to expected/ in place of compared; look at them.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { Browser } from "./browser.mjs";

const here = dirname(fileURLToPath(import.meta.url));
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
    assert.match(await browser.value("document.getElementById('message').textContent"), /Drop a .bth file/);
    await browser.drop(model, WIDTH / 2, HEIGHT / 2);
    await browser.until("/4 of 4 samples/.test(document.getElementById('status').textContent)");
    assert.match(await browser.value("document.getElementById('status').textContent"), /^knot\.bth · 2,880 triangles .* workers?$/);
    await looksAs("shaded");
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

test("a damaged file is refused with its code, and the model stays", async () => {
    const before = await picture(), damaged = join(folder, "damaged.bth");
    const bytes = readFileSync(model);
    bytes[0] ^= 1;
    writeFileSync(damaged, bytes);
    await browser.drop(damaged, WIDTH / 2, HEIGHT / 2);
    await browser.until("/damaged.bth: .*BTH-F002/.test(document.getElementById('message').textContent)");
    await browser.value(`document.getElementById("message").hidden = true`);
    assert.ok((await difference(before, await picture())) <= MOST);
});

test("nothing was asked of a network, and no error was left unseen", () => {
    assert.deepEqual(browser.requests.filter((url) => !/^(blob|data):/.test(url)), []);
    assert.deepEqual(browser.complaints, []);
});
