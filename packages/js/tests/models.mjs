// Models with materials for the tests.
import { deflateSync } from "node:zlib";

/** The checksum of PNG files. Node has it from version 20.15 on only. */
function crc32(bytes) {
    let sum = ~0;
    for (const byte of bytes) {
        sum ^= byte;
        for (let bit = 0; bit < 8; bit++) sum = sum & 1 ? (sum >>> 1) ^ 0xedb88320 : sum >>> 1;
    }
    return ~sum >>> 0;
}

/** A PNG file of texels of red, green, blue and alpha. */
export function png(width, height, texels) {
    const rows = Array.from({ length: height }, (_, y) => [0, ...texels.slice(y * width, (y + 1) * width).flat()]);
    const chunk = (kind, body) => {
        const named = Buffer.concat([Buffer.from(kind), body]), length = Buffer.alloc(4), sum = Buffer.alloc(4);
        length.writeUInt32BE(body.length);
        sum.writeUInt32BE(crc32(named));
        return Buffer.concat([length, named, sum]);
    };
    const header = Buffer.alloc(13);
    header.writeUInt32BE(width);
    header.writeUInt32BE(height, 4);
    header.set([8, 6, 0, 0, 0], 8);
    const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
    return Buffer.concat([signature, chunk("IHDR", header), chunk("IDAT", deflateSync(Buffer.from(rows.flat()))), chunk("IEND", Buffer.alloc(0))]);
}

/** Red, a darker red, a hole, and blue that stops a third of the light. */
export const FOUR_TEXELS = [[255, 0, 0, 255], [128, 0, 0, 255], [255, 255, 255, 0], [0, 0, 255, 85]];

/** A square of the side 2 with an image of these texels, above the half of a green one behind it; both without light (glTF). */
export function quads() {
    const square = (z) => [-1, -1, z, 1, -1, z, 1, 1, z, -1, 1, z];
    const bytes = Buffer.concat([
        Buffer.from(Float32Array.from([...square(0), ...square(-1).map((x, k) => (k % 3 < 2 ? 2 * x : x)), 0, 1, 1, 1, 1, 0, 0, 0]).buffer),
        Buffer.from(Uint16Array.of(0, 1, 2, 0, 2, 3).buffer),
    ]);
    const uri = (kind, data) => `data:${kind};base64,${data.toString("base64")}`;
    const extensions = { KHR_materials_unlit: {} };
    return JSON.stringify({
        asset: { version: "2.0" },
        extensionsUsed: ["KHR_materials_unlit"],
        buffers: [{ byteLength: bytes.length, uri: uri("application/octet-stream", bytes) }],
        bufferViews: [[0, 48], [48, 48], [96, 32], [128, 12]].map(([byteOffset, byteLength]) => ({ buffer: 0, byteOffset, byteLength })),
        accessors: [
            { bufferView: 0, componentType: 5126, count: 4, type: "VEC3", min: [-1, -1, 0], max: [1, 1, 0] },
            { bufferView: 1, componentType: 5126, count: 4, type: "VEC3", min: [-2, -2, -1], max: [2, 2, -1] },
            { bufferView: 2, componentType: 5126, count: 4, type: "VEC2" },
            { bufferView: 3, componentType: 5123, count: 6, type: "SCALAR" },
        ],
        images: [{ uri: uri("image/png", png(2, 2, FOUR_TEXELS)) }],
        samplers: [{ magFilter: 9728, wrapS: 33071, wrapT: 33071 }],
        textures: [{ source: 0, sampler: 0 }],
        materials: [
            { name: "glass", alphaMode: "BLEND", pbrMetallicRoughness: { baseColorTexture: { index: 0 } }, extensions },
            { name: "green", doubleSided: true, pbrMetallicRoughness: { baseColorFactor: [0, 0.5, 0, 1] }, extensions },
        ],
        meshes: [{
            primitives: [
                { attributes: { POSITION: 0, TEXCOORD_0: 2 }, indices: 3, material: 0 },
                { attributes: { POSITION: 1 }, indices: 3, material: 1 },
            ],
        }],
        nodes: [{ mesh: 0 }],
    });
}
