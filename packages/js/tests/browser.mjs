// A headless Chromium, driven over the pipes of its debugging protocol: no other program or package is needed.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

/** What a browser of a test does without: a sandbox (as root there is none), and asking the network for anything. */
const OPTIONS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--hide-scrollbars", "--force-device-scale-factor=1", "--remote-debugging-pipe",
];

export class Browser {
    #process;
    #profile = mkdtempSync(join(tmpdir(), "bth-browser-"));
    #waiting = new Map();
    #next = 1;
    #session;
    /** What pages wrote to the console as errors, and exceptions that nothing caught. */
    complaints = [];
    /** Addresses other than of the page itself that pages asked for. */
    requests = [];

    static async start(program, width, height) {
        const browser = new Browser();
        browser.#process = spawn(program, [...OPTIONS, `--user-data-dir=${browser.#profile}`, `--window-size=${width},${height}`], {
            stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"],
        });
        let text = "";
        browser.#process.stdio[4].setEncoding("utf8").on("data", (part) => {
            const messages = (text + part).split("\0");
            text = messages.pop();
            for (const message of messages) browser.#take(JSON.parse(message));
        });
        const { targetId } = await browser.send("Target.createTarget", { url: "about:blank", width, height, newWindow: true });
        const { sessionId } = await browser.send("Target.attachToTarget", { targetId, flatten: true });
        browser.#session = sessionId;
        for (const domain of ["Page", "Runtime", "Network", "DOM"]) await browser.send(`${domain}.enable`);
        // That of the window may include bars.
        await browser.resize(width, height);
        return browser;
    }

    #take({ id, result, error, method, params }) {
        if (id) {
            const { resolve, reject } = this.#waiting.get(id);
            this.#waiting.delete(id);
            error ? reject(new Error(error.message)) : resolve(result);
        } else if (method === "Runtime.exceptionThrown") {
            this.complaints.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
        } else if (method === "Runtime.consoleAPICalled" && params.type === "error") {
            this.complaints.push(params.args.map((arg) => arg.value ?? arg.description).join(" "));
        } else if (method === "Network.requestWillBeSent" && params.request.url !== params.documentURL) {
            this.requests.push(params.request.url);
        }
    }

    send(method, params = {}) {
        const id = this.#next++;
        const message = { id, method, params, ...(this.#session && { sessionId: this.#session }) };
        this.#process.stdio[3].write(`${JSON.stringify(message)}\0`);
        return new Promise((resolve, reject) => this.#waiting.set(id, { resolve, reject }));
    }

    /** Gives the page a size, and pixels of the screen for each of its own. */
    async resize(width, height, deviceScaleFactor = 1) {
        await this.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor, mobile: false });
    }

    open(url) {
        return this.send("Page.navigate", { url });
    }

    /** The value of an expression in the page, a promise's when it has one. */
    async value(expression) {
        const { result, exceptionDetails } = await this.send("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
        if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
        return result.value;
    }

    /** Waits until an expression is true. */
    async until(expression, seconds = 60) {
        const end = Date.now() + 1000 * seconds;
        while (!(await this.value(expression))) {
            if (Date.now() > end) throw new Error(`still not true after ${seconds} s: ${expression}`);
            await new Promise((resolve) => setTimeout(resolve, 50));
        }
    }

    /** Drops a file onto the page, as a person does. */
    async drop(file, x, y) {
        const data = { items: [], files: [file].flat(), dragOperationsMask: 1 };
        for (const type of ["dragEnter", "dragOver", "drop"]) await this.send("Input.dispatchDragEvent", { type, x, y, data });
    }

    async mouse(type, x, y, options = {}) {
        await this.send("Input.dispatchMouseEvent", { type, x, y, button: "left", buttons: 1, clickCount: 1, ...options });
    }

    /** A screenshot: PNG, base64. */
    async screenshot() {
        return (await this.send("Page.captureScreenshot", { format: "png" })).data;
    }

    async end() {
        const ended = new Promise((resolve) => this.#process.on("exit", resolve));
        // The process may be over before it answers.
        this.#session = undefined;
        this.send("Browser.close").catch(() => {});
        const late = setTimeout(() => this.#process.kill("SIGKILL"), 3000);
        await ended;
        clearTimeout(late);
        for (const pipe of this.#process.stdio) pipe?.destroy();
        rmSync(this.#profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
    }
}
