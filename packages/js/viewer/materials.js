// The materials of a scene, with their images decoded.

/** Texels of all images of a scene at most, for each worker has its own: where there are more, images are made smaller. */
const MOST_TEXELS = 2 ** 23;

/** Linear values of the bytes of sRGB. */
const LINEAR = Float32Array.from({ length: 256 }, (_, i) => {
    const x = i / 255;
    return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
});

/**
 * The materials of a scene's objects: `of(object, material)` has one with `baseColorTexture` and `emissiveTexture` as what `texel`
 * takes, or undefined. `undecoded` is the number of images that the browser does not decode: base colours count as white then, and what
 * would emit does not.
 */
export async function materialsOf(scene, decode = decoded) {
    const objects = Array.from({ length: scene.objects }, (_, object) => ({
        materials: scene.materials(object),
        textures: scene.textures(object),
    }));
    // Objects of a file share images.
    const files = new Map();
    objects.forEach(({ textures }, object) => {
        textures.forEach(({ image }, texture) => files.has(image) || files.set(image, () => scene.image(object, texture)));
    });
    const images = new Map();
    // One after the other, since an image takes memory while it is decoded.
    for (const [image, bytes] of files) images.set(image, await decode(bytes(), MOST_TEXELS / files.size).catch(() => null));
    const found = objects.map(({ materials, textures }) => {
        const used = (index) => {
            const texture = index === null ? undefined : textures[index], image = texture && images.get(texture.image);
            return image ? { ...texture, ...image } : null;
        };
        return materials.map((material) => {
            const baseColorTexture = used(material.baseColorTexture), emissiveTexture = used(material.emissiveTexture);
            const emissive = material.emissiveTexture === null || emissiveTexture ? material.emissive : [0, 0, 0];
            return { ...material, baseColorTexture, emissiveTexture, emissive };
        });
    });
    return {
        of: (object, material) => found[object]?.[material],
        undecoded: [...images.values()].filter((image) => image === null).length,
    };
}

/** The texels of an image file, bytes of red, green, blue and alpha, made smaller where it has more than `most`. */
async function decoded(bytes, most) {
    const whole = await createImageBitmap(new Blob([bytes]), { premultiplyAlpha: "none", colorSpaceConversion: "none" });
    const shrink = Math.min(1, Math.sqrt(most / (whole.width * whole.height)));
    const [width, height] = [whole.width, whole.height].map((side) => Math.max(1, Math.floor(side * shrink)));
    const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
    context.imageSmoothingQuality = "high";
    context.drawImage(whole, 0, 0, width, height);
    whole.close();
    return { width, height, texels: context.getImageData(0, 0, width, height).data };
}

/** The index of a texel along one side of an image, for any index, by a wrap mode. */
function wrapped(index, size, mode) {
    if (mode === "clamp") return Math.min(Math.max(index, 0), size - 1);
    if (mode === "repeat") return index - size * Math.floor(index / size);
    const twice = index - 2 * size * Math.floor(index / (2 * size));
    return twice < size ? twice : 2 * size - 1 - twice;
}

/** Linear red, green and blue, and alpha of a texture at coordinates of its set. Texels without coordinates are white. */
export function texel({ transform: [a, b, c, d, e, f], width, height, texels, wrap, filter }, u, v) {
    // The middle of a texel is half a texel from its ends.
    const x = (a * u + b * v + c) * width - 0.5, y = (d * u + e * v + f) * height - 0.5;
    if (!Number.isFinite(x) || !Number.isFinite(y)) return [1, 1, 1, 1];
    const at = (i, j) => 4 * (wrapped(j, height, wrap[1]) * width + wrapped(i, width, wrap[0]));
    if (filter === "nearest") {
        const from = at(Math.round(x), Math.round(y));
        return [LINEAR[texels[from]], LINEAR[texels[from + 1]], LINEAR[texels[from + 2]], texels[from + 3] / 255];
    }
    const i = Math.floor(x), j = Math.floor(y), right = x - i, down = y - j;
    const corners = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
    const weights = [(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down];
    const sum = [0, 0, 0, 0];
    corners.forEach((from, k) => {
        for (let channel = 0; channel < 3; channel++) sum[channel] += weights[k] * LINEAR[texels[from + channel]];
        sum[3] += (weights[k] * texels[from + 3]) / 255;
    });
    return sum;
}
