// Workers that each hold a copy of the file.

/** Workers at most, and bytes that all copies of a file may take together. */
const MOST_WORKERS = 16, MOST_BYTES = 2 ** 31;

/** Workers to start for a file of this many bytes. */
export function workersFor(bytes) {
    const cores = navigator.hardwareConcurrency || 2;
    return Math.max(1, Math.min(cores, MOST_WORKERS, Math.floor(MOST_BYTES / Math.max(bytes, 1))));
}

/** One worker, to which requests are sent by kind. */
class Helper {
    #worker;
    #waiting = new Map();
    #next = 0;

    constructor(url) {
        this.#worker = new Worker(url);
        this.#worker.onmessage = ({ data }) => {
            const { resolve, reject } = this.#waiting.get(data.id);
            this.#waiting.delete(data.id);
            data.error === undefined ? resolve(data.answer) : reject(new Error(data.error));
        };
        this.#worker.onerror = (event) => {
            for (const { reject } of this.#waiting.values()) reject(new Error(event.message || "a worker cannot be started; a content security policy must allow worker-src blob:"));
            this.#waiting.clear();
        };
    }

    ask(kind, request = {}, transfer = []) {
        const id = this.#next++;
        return new Promise((resolve, reject) => {
            this.#waiting.set(id, { resolve, reject });
            this.#worker.postMessage({ ...request, kind, id }, transfer);
        });
    }

    end() {
        this.#worker.terminate();
    }
}

/** Compiles a model file in a worker of its own, whose memory ends with it. */
export async function compileModel(url, module, name, file) {
    const helper = new Helper(url);
    try {
        return await helper.ask("compile", { module, name, file }, [file]);
    } finally {
        helper.end();
    }
}

/** The workers of an open file. */
export class Pool {
    #helpers = [];

    /** Starts workers and opens a file in each; returns the pool and what the file holds. */
    static async open(url, module, file) {
        const pool = new Pool();
        const count = workersFor(file.byteLength);
        try {
            // The first alone, so that a file that cannot be opened is refused once.
            const content = await pool.#add(url, module, file);
            const others = Array.from({ length: count - 1 }, () => pool.#add(url, module, file));
            // Where memory ends, fewer workers do.
            await Promise.allSettled(others);
            return { pool, content };
        } catch (error) {
            pool.end();
            throw error;
        }
    }

    async #add(url, module, file) {
        const helper = new Helper(url);
        try {
            await helper.ask("module", { module });
            const content = await helper.ask("open", { file });
            this.#helpers.push(helper);
            return content;
        } catch (error) {
            helper.end();
            throw error;
        }
    }

    get size() {
        return this.#helpers.length;
    }

    /** Asks the first worker. */
    ask(kind, request) {
        return this.#helpers[0].ask(kind, request);
    }

    /** Asks all workers; the answer of the first. */
    async askAll(kind, request) {
        return (await Promise.all(this.#helpers.map((helper) => helper.ask(kind, request))))[0];
    }

    /** Lets all workers take jobs until there are none, or until `stopped` says so; `done` gets each answer. */
    async work(jobs, stopped, done) {
        let next = 0;
        const take = async (helper) => {
            while (next < jobs.length && !stopped()) {
                const job = jobs[next++];
                const answer = await helper.ask("tile", { job });
                if (!stopped()) done(job, answer);
            }
        };
        await Promise.all(this.#helpers.map(take));
    }

    end() {
        for (const helper of this.#helpers) helper.end();
        this.#helpers = [];
    }
}
