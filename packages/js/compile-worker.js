// The worker of CompilerWorker: the first message names the module, each other one is a mesh.

import { loadCompiler } from "./compile.js";

let compiler;
addEventListener("message", async ({ data: { source, id, positions, indices, deformable } }) => {
    if (id === undefined) {
        compiler = loadCompiler(source);
        // The first mesh tells what is wrong.
        compiler.catch(() => {});
        return;
    }
    try {
        const warnings = [];
        const bytes = (await compiler).compile(positions, indices, { deformable, onWarning: (text) => warnings.push(text) });
        postMessage({ id, bytes, warnings }, [bytes.buffer]);
    } catch (error) {
        postMessage({ id, error: String(error.message ?? error) });
    }
});
