// The camera orbits around a target.

import { add, cross, dot, length, scale, unit } from "./vectors.js";

/** Half the vertical field of view, radians: narrow enough to keep proportions natural. */
const HALF_FOV = (16 * Math.PI) / 180;
/** Share of the height of the picture, or of its width where that is less, that the model's sphere fills. */
const FILLED = 1.05;
/** The camera stays this far from the poles, radians. */
const POLE = 0.01;

/** A view of bounds from the front, somewhat to the side and above, for a picture with this ratio of width to height. All of them are seen. */
export function firstView({ lower, upper }, up, aspect) {
    const target = scale(add(lower, upper), 0.5);
    const radius = Math.max(length(add(upper, lower, -1)) / 2, Number.MIN_VALUE);
    const half = aspect < 1 ? Math.atan(Math.tan(HALF_FOV) * aspect) : HALF_FOV;
    const view = { target, up, yaw: 0.61, pitch: 0.35, distance: radius / Math.sin(half) / FILLED, radius };
    const camera = cameraOf(view, aspect);
    for (let corner = 0; corner < 8; corner++) {
        const to = add(target.map((_, k) => ((corner >> k) & 1 ? upper : lower)[k]), target, -1);
        for (const [k, axis] of [camera.right, camera.up].entries()) {
            // From there on it lies on the picture's edge or within.
            view.distance = Math.max(view.distance, Math.abs(dot(to, axis)) / camera.half[k] - dot(to, camera.forward));
        }
    }
    return view;
}

/** Turns a view by angles in radians. */
export function turned(view, yaw, pitch) {
    const limit = Math.PI / 2 - POLE;
    return { ...view, yaw: view.yaw + yaw, pitch: Math.min(Math.max(view.pitch + pitch, -limit), limit) };
}

/** Moves the target in the plane of the picture, by shares of the picture's height. */
export function shifted(view, right, up) {
    const camera = cameraOf(view, 1);
    const height = 2 * camera.half[1] * view.distance;
    return { ...view, target: add(add(view.target, camera.right, right * height), camera.up, up * height) };
}

/** The smallest and the largest distance of the camera from its target, relative to the radius of the scene. */
const NEAREST = 1e-4, FARTHEST = 1e3;

/** Moves closer or farther. */
export function zoomed(view, factor) {
    const distance = Math.min(Math.max(view.distance * factor, view.radius * NEAREST), view.radius * FARTHEST);
    return { ...view, distance };
}

/** The pinhole camera of a view: its eye, an orthonormal basis, and half the width and height of the picture at distance 1. */
export function cameraOf(view, aspect) {
    const vertical = view.up === "z" ? [0, 0, 1] : [0, 1, 0];
    const front = view.up === "z" ? [0, -1, 0] : [0, 0, 1];
    const side = [1, 0, 0];
    const flat = add(scale(side, Math.sin(view.yaw)), front, Math.cos(view.yaw));
    const towards = add(scale(flat, Math.cos(view.pitch)), vertical, Math.sin(view.pitch));
    const forward = scale(towards, -1);
    const right = unit(cross(forward, vertical));
    const half = Math.tan(HALF_FOV);
    return {
        eye: add(view.target, towards, view.distance),
        right,
        up: cross(right, forward),
        forward,
        half: [half * aspect, half],
        vertical,
    };
}

/** Whether a point lies in a box. */
export function contains({ lower, upper }, point) {
    return point.every((x, k) => lower[k] < x && x < upper[k]);
}

/** The unit direction through a point of the picture: (-1, -1) is the lower left corner, (1, 1) the upper right. */
export function directionThrough(camera, x, y) {
    const { right, up, forward, half } = camera, across = x * half[0], along = y * half[1];
    const to = [
        forward[0] + across * right[0] + along * up[0],
        forward[1] + across * right[1] + along * up[1],
        forward[2] + across * right[2] + along * up[2],
    ];
    return unit(to);
}

/** Rays that descend less, relative to their length, end at the horizon and reach no ground. */
const HORIZON = 1e-6;

/** Where a ray meets the plane through a height along the vertical from above, or null. */
export function onGround(camera, direction, height) {
    const above = dot(camera.eye, camera.vertical) - height, descent = -dot(direction, camera.vertical);
    return above > 0 && descent > HORIZON ? add(camera.eye, direction, above / descent) : null;
}
