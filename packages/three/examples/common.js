// What all examples share: a stage with light and a camera, and the line of figures.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

/** Shows a text at the bottom of the page. */
export function report(text) {
    document.getElementById("report").textContent = text;
}

/** A number with its thousands apart. */
export const counted = (n) => Math.round(n).toLocaleString("en");

/** Tells the tests that the first picture is there, and what was computed. */
export function done(result) {
    requestAnimationFrame(() => requestAnimationFrame(() => (window.result ??= result)));
}

/** A scene with light, a floor with shadows if `floor` gives its height, and a camera that turns by hand. */
export function stage({ eye = [3, 2.2, 4], target = [0, 0, 0], floor = null, background = 0xe9edf2 } = {}) {
    const renderer = new THREE.WebGLRenderer({ antialias: true });
    renderer.toneMapping = THREE.ACESFilmicToneMapping;
    renderer.shadowMap.enabled = true;
    document.body.append(renderer.domElement);

    const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(40, 1, 0.05, 200);
    scene.background = new THREE.Color(background);
    scene.add(new THREE.HemisphereLight(0xdfe9f5, 0x8a7f74, 1.9));
    const fill = new THREE.DirectionalLight(0xbcd4ff, 0.7), sun = new THREE.DirectionalLight(0xfff3e0, 2.6);
    fill.position.set(-5, 2, 3);
    scene.add(fill);
    sun.position.set(4, 8, 5);
    sun.castShadow = true;
    sun.shadow.mapSize.set(1024, 1024);
    sun.shadow.radius = 4;
    sun.shadow.normalBias = 0.03;
    Object.assign(sun.shadow.camera, { left: -6, right: 6, top: 6, bottom: -6, far: 30 });
    scene.add(sun);
    if (floor !== null) {
        const ground = new THREE.Mesh(new THREE.PlaneGeometry(60, 60), new THREE.ShadowMaterial({ opacity: 0.28 }));
        ground.rotation.x = -Math.PI / 2;
        ground.position.y = floor;
        ground.receiveShadow = true;
        scene.add(ground);
    }
    camera.position.set(...eye);
    const controls = new OrbitControls(camera, renderer.domElement);
    controls.target.set(...target);
    controls.update();

    const resize = () => {
        renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
        renderer.setSize(innerWidth, innerHeight);
        camera.aspect = innerWidth / innerHeight;
        camera.updateProjectionMatrix();
    };
    addEventListener("resize", resize);
    resize();
    /** Draws forever; calls `step` with the seconds before each picture. */
    const run = (step = () => {}) => {
        renderer.setAnimationLoop((milliseconds) => {
            step(milliseconds / 1000);
            renderer.render(scene, camera);
        });
    };
    return { scene, camera, renderer, controls, run };
}

/** A mesh with a matt material that casts and receives shadows. */
export function model(geometry, color = 0xd9a066, more = {}) {
    const mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color, roughness: 0.55, ...more }));
    mesh.castShadow = mesh.receiveShadow = true;
    return mesh;
}

/** Random numbers from 0 to 1 that are the same on each run (mulberry32). */
export function random(seed) {
    return () => {
        seed = (seed + 0x6d2b79f5) | 0;
        let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
        t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
        return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
    };
}

/** A canvas that fills the window, for pictures that are computed pixel by pixel; `draw` gets its size. */
export function picture(draw, scale = 1) {
    const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
    document.body.append(canvas);
    const redraw = () => {
        const width = Math.round(innerWidth * scale), height = Math.round(innerHeight * scale);
        const image = new ImageData(width, height);
        draw(image.data, width, height);
        [canvas.width, canvas.height] = [width, height];
        context.putImageData(image, 0, 0);
    };
    addEventListener("resize", redraw);
    return { canvas, redraw };
}

/** Camera rays of a picture, eight numbers each, in tiles of 8 by 8 pixels; `pixelOf[i]` is the pixel of ray i. */
export function cameraRays(eye, target, width, height, fov = 40) {
    const camera = new THREE.PerspectiveCamera(fov, width / height, 0.1, 1);
    camera.position.fromArray(eye);
    camera.lookAt(...target);
    camera.updateMatrixWorld();
    const rays = new Float32Array(8 * width * height), pixelOf = new Uint32Array(width * height), to = new THREE.Vector3();
    let i = 0;
    for (let top = 0; top < height; top += 8) {
        for (let left = 0; left < width; left += 8) {
            for (let y = top; y < Math.min(top + 8, height); y++) {
                for (let x = left; x < Math.min(left + 8, width); x++, i++) {
                    to.set((2 * x + 1) / width - 1, 1 - (2 * y + 1) / height, 0.5).unproject(camera).sub(camera.position).normalize();
                    rays.set(eye, 8 * i);
                    to.toArray(rays, 8 * i + 4);
                    rays[8 * i + 7] = Infinity;
                    pixelOf[i] = y * width + x;
                }
            }
        }
    }
    return { rays, pixelOf };
}
