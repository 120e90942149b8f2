// The page of examples in a headless Chromium: each shows a picture, complains of nothing, and computes what is right.
//
//   OUT=FOLDER CHROMIUM=PROGRAM node --test examples.test.mjs
//
// OUT is what build.mjs assembled. Its index page shows the pictures; screenshots/ has the whole pages.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join, normalize, resolve } from "node:path";
import { after, before, test } from "node:test";
import { Browser } from "../../js/tests/browser.mjs";

const OUT = resolve(process.env.OUT), WIDTH = 640, HEIGHT = 400;
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".json": "application/json", ".css": "text/css", ".wasm": "application/wasm", ".png": "image/png" };

/** What each example has computed, and what is right. */
const RIGHT = {
    raycast: ({ hits, rays, sameAsThree }) => hits > rays / 2 && sameAsThree,
    leak: ({ ours, share }) => ours === 0 && share > 0.01,
    ao: ({ mean }) => mean > 0.5 && mean < 0.9,
    sdf: ({ deepest, share }) => deepest > 0.3 && deepest < 0.331 && share > 0.05 && share < 0.3,
    lidar: ({ hits, nearest }) => hits > 30_000 && nearest > 0.1 && nearest < 2,
    contains: ({ found, expected }) => Math.abs(found / expected - 1) < 0.03,
    skinned: ({ hits, sameAsThree }) => hits > 50 && sameAsThree,
    instances: ({ instances, hits }) => instances === 1_000_000 && hits > 0.5 && hits < 1,
    cutaway: ({ filled, parts }) => filled > 0.05 && filled < 0.5 && parts >= 5,
    compile: ({ triangles, bytes, face }) => triangles > 50_000 && bytes > 32 * triangles && face >= 0,
};

let browser, server, address;
before(async () => {
    server = createServer((request, response) => {
        const path = normalize(decodeURIComponent(new URL(request.url, "http://a").pathname));
        try {
            const bytes = readFileSync(join(OUT, path));
            response.writeHead(200, { "content-type": TYPES[extname(path)] ?? "application/octet-stream" }).end(bytes);
        } catch {
            response.writeHead(404).end();
        }
    });
    await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
    address = `http://127.0.0.1:${server.address().port}`;
    browser = await Browser.start(process.env.CHROMIUM, WIDTH, HEIGHT);
    mkdirSync(join(OUT, "thumbnails"), { recursive: true });
});
after(async () => {
    await browser?.end();
    server?.close();
});

/** Mean and deviation of the brightness of a picture (PNG, base64), and its number of colours; computed in the page. */
const measured = (png) => browser.value(`(async () => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob("${png}"), (c) => c.charCodeAt(0))], { type: "image/png" }));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height), colors = new Set();
    let sum = 0, squares = 0;
    for (let i = 0; i < data.length; i += 4) {
        const light = (data[i] + data[i + 1] + data[i + 2]) / 3;
        sum += light;
        squares += light * light;
        colors.add((data[i] >> 3) << 10 | (data[i + 1] >> 3) << 5 | data[i + 2] >> 3);
    }
    const n = data.length / 4, mean = sum / n;
    return { mean, deviation: Math.sqrt(squares / n - mean * mean), colors: colors.size };
})()`);

const examples = JSON.parse(readFileSync(join(OUT, "examples.json")));
for (const { name, title } of examples) {
    test(`${name}: a picture and a right figure`, { timeout: 300_000 }, async () => {
        browser.complaints.length = 0;
        await browser.open(`${address}/${name}.html`);
        await browser.until(`document.title === ${JSON.stringify(`${title} · bth`)} && window.result !== undefined`, 280).catch((error) => {
            throw new Error(`${error.message}\n${browser.complaints.join("\n")}`);
        });
        const result = await browser.value("window.result");
        mkdirSync(join(OUT, "screenshots"), { recursive: true });
        writeFileSync(join(OUT, "screenshots", `${name}.png`), Buffer.from(await browser.screenshot(), "base64"));
        // Without the words, which are small in a small picture.
        await browser.value(`document.querySelectorAll("header, output, .controls").forEach((element) => (element.hidden = true))`);
        const png = await browser.screenshot();
        writeFileSync(join(OUT, "thumbnails", `${name}.png`), Buffer.from(png, "base64"));
        assert.deepEqual(browser.complaints, []);
        assert.ok(RIGHT[name](result), JSON.stringify(result));
        const { deviation, colors } = await measured(png);
        assert.ok(deviation > 12 && colors > 100, `brightness deviates by ${deviation}, ${colors} colours`);
        const lines = (await (await fetch(`${address}/${name}.js`)).text()).trimEnd().split("\n").length;
        assert.ok(lines <= 150, `${lines} lines`);
    });
}

test("the index shows all of them", async () => {
    browser.complaints.length = 0;
    await browser.open(`${address}/index.html`);
    await browser.until(`[...document.images].filter((image) => image.complete && image.naturalWidth === ${WIDTH}).length === ${examples.length}`);
    writeFileSync(join(OUT, "screenshots/index.png"), Buffer.from(await browser.screenshot(), "base64"));
    assert.deepEqual(browser.complaints, []);
});
