// Times libraries with the interface of Embree 4, one ray a call, in one process and interleaved. Started by
// tools/embree/bench, which also writes the model. The declarations follow Embree's public manual.
//
//   bench trace MODEL RAYS ROUNDS INSIDE CONFIG NAME=LIBRARY...    times of all ray sets
//   bench commit MODEL CONFIG NAME=LIBRARY                         time and memory of building a scene
//
// MODEL: u32 vertices, u32 triangles, then f32 xyz of each vertex and three u32 of each triangle. Prints JSON lines.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <time.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

typedef struct { float x, y, z; } V;
// A ray of 48 bytes, then the hit; a build without instance arrays does not write the last word.
typedef struct __attribute__((aligned(16))) {
    V o; float tnear; V d; float time; float tfar; uint32_t mask, id, flags;
    V ng; float u, v; uint32_t primitive, geometry, instance, instance_primitive;
} Ray;
typedef struct { uint32_t instance, instance_primitive, own; } Context;
typedef struct { int *valid; void *user; Context *context; Ray *ray; uint32_t *hit; uint32_t count; } FilterArguments;
typedef struct { int flags; uint32_t features; Context *context; void (*filter)(FilterArguments *); void *intersect; float width; } Arguments;
enum { ROBUST = 4, FILTER = 8, INVOKE_FILTER = 2, INDEX = 0, VERTEX = 1, UINT3 = 0x5003, FLOAT3 = 0x9003, NONE = -1 };

#define FUNCTIONS(F) \
    F(void *, rtcNewDevice, (const char *)) F(void, rtcReleaseDevice, (void *)) F(int, rtcGetDeviceError, (void *)) \
    F(void, rtcSetDeviceMemoryMonitorFunction, (void *, bool (*)(void *, ssize_t, bool), void *)) \
    F(void *, rtcNewScene, (void *)) F(void, rtcReleaseScene, (void *)) F(void, rtcSetSceneFlags, (void *, int)) \
    F(void *, rtcNewGeometry, (void *, int)) F(void, rtcReleaseGeometry, (void *)) F(void, rtcCommitGeometry, (void *)) \
    F(void, rtcSetSharedGeometryBuffer, (void *, int, unsigned, int, const void *, size_t, size_t, size_t)) \
    F(unsigned, rtcAttachGeometry, (void *, void *)) F(void, rtcCommitScene, (void *)) \
    F(void, rtcIntersect1, (void *, Ray *, Arguments *)) F(void, rtcOccluded1, (void *, Ray *, Arguments *))
#define FIELD(result, name, arguments) result(*name) arguments;
typedef struct { FUNCTIONS(FIELD) } Functions;
typedef struct { char name[64]; Functions f; void *device, *scenes[4]; } Library; // scenes: fast, robust; both with filters

static V *vertices;
static uint32_t (*triangles)[3], vertex_count, triangle_count;
static ssize_t bytes, peak_bytes;

static V add(V a, V b) { return (V){a.x + b.x, a.y + b.y, a.z + b.z}; }
static V scale(V a, float s) { return (V){a.x * s, a.y * s, a.z * s}; }
static V sub(V a, V b) { return add(a, scale(b, -1)); }
static float dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static V cross(V a, V b) { return (V){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
static V unit(V a) { return scale(a, 1 / sqrtf(dot(a, a) + 1e-37f)); }
static float uniform(void) {
    static uint64_t state = 88172645463325252ull;
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return (float)(state >> 40) / (1 << 24);
}
static V on_sphere(void) {
    float z = 2 * uniform() - 1, a = 6.2831853f * uniform(), r = sqrtf(fmaxf(0, 1 - z * z));
    return (V){r * cosf(a), r * sinf(a), z};
}
static double seconds(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return now.tv_sec + now.tv_nsec * 1e-9;
}
static void fail(const char *what, const char *which) {
    fprintf(stderr, "error: %s %s\n", what, which);
    exit(2);
}

static void open_library(Library *library, char *name_and_path, const char *config) {
    char *path = strchr(name_and_path, '=');
    if (!path) fail("expected NAME=LIBRARY, found", name_and_path);
    snprintf(library->name, sizeof library->name, "%.*s", (int)(path - name_and_path), name_and_path);
    void *handle = dlopen(path + 1, RTLD_NOW | RTLD_LOCAL);
    if (!handle) fail("cannot load:", dlerror());
#define LOAD(result, symbol, arguments) \
    if (!(*(void **)&library->f.symbol = dlsym(handle, #symbol))) fail("not exported:", #symbol);
    FUNCTIONS(LOAD)
    library->device = library->f.rtcNewDevice(config);
    if (!library->device) fail("no device from", path + 1);
}

static void *commit(Library *library, int flags, double *wall, double *cpu) {
    Functions *f = &library->f;
    void *scene = f->rtcNewScene(library->device), *mesh = f->rtcNewGeometry(library->device, 0);
    f->rtcSetSceneFlags(scene, flags);
    f->rtcSetSharedGeometryBuffer(mesh, VERTEX, 0, FLOAT3, vertices, 0, 12, vertex_count);
    f->rtcSetSharedGeometryBuffer(mesh, INDEX, 0, UINT3, triangles, 0, 12, triangle_count);
    *wall = seconds(CLOCK_MONOTONIC), *cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
    f->rtcCommitGeometry(mesh);
    f->rtcAttachGeometry(scene, mesh);
    f->rtcReleaseGeometry(mesh);
    f->rtcCommitScene(scene);
    *wall = seconds(CLOCK_MONOTONIC) - *wall, *cpu = seconds(CLOCK_PROCESS_CPUTIME_ID) - *cpu;
    int error = f->rtcGetDeviceError(library->device);
    if (error) fprintf(stderr, "%s: error %d of the device after the commit\n", library->name, error), exit(2);
    return scene;
}

static void reject_own(FilterArguments *arguments) {
    if (arguments->hit[5] == arguments->context->own) arguments->valid[0] = 0;
}

// A set of rays: `own` holds the triangle that each starts on, and is null where that may be hit.
typedef struct { const char *name; bool any; Ray *rays; uint32_t *own, count; } Set;

static Ray ray(V o, V d, float tfar) {
    Ray made = {o, 0, d, 0, tfar, UINT32_MAX, 0, 0, {0, 0, 0}, 0, 0, NONE, NONE, NONE, NONE};
    return made;
}
static void push(Set *set, Ray made, uint32_t own) {
    if (set->own) set->own[set->count] = own;
    set->rays[set->count++] = made;
}
// Traces a set and returns the CPU seconds; writes the distance of each hit, or that there is one.
static double trace(Library *library, void *scene, const Set *set, float *found) {
    Context context = {NONE, NONE, NONE};
    Arguments filter = {INVOKE_FILTER, UINT32_MAX, &context, reject_own, NULL, 0};
    Arguments *arguments = set->own ? &filter : NULL;
    double start = seconds(CLOCK_THREAD_CPUTIME_ID);
    for (uint32_t i = 0; i < set->count; i++) {
        Ray one = set->rays[i];
        if (set->own) context.own = set->own[i];
        if (set->any) library->f.rtcOccluded1(scene, &one, arguments), found[i] = one.tfar < 0 ? 0 : INFINITY;
        else library->f.rtcIntersect1(scene, &one, arguments), found[i] = one.geometry == (uint32_t)NONE ? INFINITY : one.tfar;
    }
    return seconds(CLOCK_THREAD_CPUTIME_ID) - start;
}

static void camera(Set *set, V eye, V target, float tangent, uint32_t count) {
    V forward = unit(sub(target, eye)), right = unit(cross(forward, fabsf(forward.y) > 0.99f ? (V){1, 0, 0} : (V){0, 1, 0}));
    V up = cross(right, forward);
    uint32_t height = (uint32_t)sqrtf(count / 16 * 9.0f / 16) * 4, width = count / height / 4 * 4;
    for (uint32_t block = 0; block < width * height / 16; block++)
        for (uint32_t i = 0; i < 16; i++) {
            uint32_t x = block % (width / 4) * 4 + i % 4, y = block / (width / 4) * 4 + i / 4;
            float sx = (2 * (x + 0.5f) / width - 1) * tangent * 16 / 9, sy = (1 - 2 * (y + 0.5f) / height) * tangent;
            push(set, ray(eye, unit(add(forward, add(scale(right, sx), scale(up, sy)))), INFINITY), NONE);
        }
}

enum { CAMERA, CLOSE, DIFFUSE, AO, SHADOW, RANDOM, BOUNCE, BOUNCE_AO, SETS };
static const char *names[SETS] = {"camera", "closeup", "diffuse", "ao", "shadow", "random", "bounce", "bounce_ao"};
static Set sets[SETS];

// Makes all sets; where the camera's rays hit is found with the robust scene of the first library.
static void make_sets(Library *library, uint32_t count, bool inside) {
    V low = vertices[0], high = low;
    for (uint32_t i = 0; i < vertex_count; i++) {
        V p = vertices[i];
        low = (V){fminf(low.x, p.x), fminf(low.y, p.y), fminf(low.z, p.z)};
        high = (V){fmaxf(high.x, p.x), fmaxf(high.y, p.y), fmaxf(high.z, p.z)};
    }
    V center = scale(add(low, high), 0.5f), size = sub(high, low);
    float diagonal = sqrtf(dot(size, size));
    for (int i = 0; i < SETS; i++) {
        sets[i].name = names[i], sets[i].any = i == AO || i == SHADOW || i == BOUNCE_AO;
        sets[i].rays = aligned_alloc(64, ((size_t)count * 2 * sizeof(Ray) + 63) / 64 * 64);
        sets[i].own = i >= BOUNCE ? calloc(count * 2, 4) : NULL;
    }
    V eye = inside ? center : add(center, scale(unit((V){0.8f, 0.5f, 1}), diagonal));
    camera(&sets[CAMERA], eye, inside ? add(center, (V){size.x, size.y * 0.1f, size.z}) : center, inside ? 0.7f : 0.26f, count);
    V light = inside ? eye : add(center, scale((V){0.4f, 1.1f, 0.9f}, diagonal));
    uint32_t near = 0;
    float nearest = INFINITY;
    V close_eye = eye, close_target = center;
    for (uint32_t i = 0; i < sets[CAMERA].count; i++) {
        Ray hit = sets[CAMERA].rays[i];
        library->f.rtcIntersect1(library->scenes[1], &hit, NULL);
        if (hit.geometry == (uint32_t)NONE) continue;
        uint32_t *of = triangles[hit.primitive], own = hit.primitive;
        V n = unit(cross(sub(vertices[of[1]], vertices[of[0]]), sub(vertices[of[2]], vertices[of[0]])));
        if (dot(n, hit.d) > 0) n = scale(n, -1);
        V p = add(hit.o, scale(hit.d, hit.tfar)), off = add(p, scale(n, 2e-5f * diagonal));
        V d = unit(add(n, scale(on_sphere(), 0.9999f))), e = unit(add(n, scale(on_sphere(), 0.9999f))), l = sub(light, off);
        push(&sets[DIFFUSE], ray(off, d, INFINITY), own);
        push(&sets[BOUNCE], ray(p, d, INFINITY), own);
        push(&sets[AO], ray(off, e, 0.05f * diagonal), own);
        push(&sets[BOUNCE_AO], ray(p, e, 0.05f * diagonal), own);
        if (dot(l, n) > 0) push(&sets[SHADOW], ray(off, unit(l), sqrtf(dot(l, l)) * 0.9999f), own);
        if (near++ % 7 == 0 && hit.tfar < nearest)
            nearest = hit.tfar, close_target = p, close_eye = add(p, scale(add(scale(n, 0.6f), scale(d, 0.4f)), 0.04f * diagonal));
    }
    camera(&sets[CLOSE], close_eye, close_target, 0.58f, count);
    for (uint32_t i = 0; i < count; i++) {
        V p = add(center, scale(on_sphere(), 0.55f * diagonal)), q = add(center, scale(on_sphere(), 0.55f * diagonal));
        push(&sets[RANDOM], ray(p, unit(sub(q, p)), INFINITY), NONE);
    }
}

static int by_value(const void *a, const void *b) { return (*(double *)a > *(double *)b) - (*(double *)a < *(double *)b); }
static bool monitor(void *user, ssize_t change, bool post) {
    (void)user, (void)post;
    ssize_t now = __atomic_add_fetch(&bytes, change, __ATOMIC_RELAXED);
    if (now > peak_bytes) peak_bytes = now;
    return true;
}
static long status(const char *field) {
    char line[256];
    long kib = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof line, file))
        if (!strncmp(line, field, strlen(field))) kib = atol(line + strlen(field) + 1);
    if (file) fclose(file);
    return kib;
}

int main(int count, char **words) {
    bool tracing = count >= 8 && !strcmp(words[1], "trace");
    if (!tracing && (count != 5 || strcmp(words[1], "commit"))) fail("usage:", "bench trace|commit MODEL ...");
    FILE *file = fopen(words[2], "rb");
    if (!file || fread(&vertex_count, 4, 1, file) != 1 || fread(&triangle_count, 4, 1, file) != 1) fail("cannot read", words[2]);
    vertices = calloc(vertex_count + 2, sizeof(V)), triangles = calloc(triangle_count + 2, 12);
    if (fread(vertices, 12, vertex_count, file) != vertex_count || fread(triangles, 12, triangle_count, file) != triangle_count)
        fail("too short:", words[2]);
#if defined(__x86_64__)
    _mm_setcsr(_mm_getcsr() | 0x8040); // The manual asks programs to flush denormals to zero.
#endif
    double wall, cpu;
    if (!tracing) {
        Library library;
        open_library(&library, words[4], words[3]);
        library.f.rtcSetDeviceMemoryMonitorFunction(library.device, monitor, NULL);
        long before = status("VmRSS");
        void *scene = commit(&library, 0, &wall, &cpu);
        printf("{\"library\": \"%s\", \"commit_s\": %.4f, \"commit_cpu_s\": %.4f, \"bytes\": %zd, \"peak_bytes\": %zd, "
               "\"rss_kib\": %ld, \"peak_rss_kib\": %ld}\n", library.name, wall, cpu, bytes, peak_bytes,
               status("VmRSS") - before, status("VmHWM") - before);
        library.f.rtcReleaseScene(scene);
        library.f.rtcReleaseDevice(library.device);
        return 0;
    }
    int rounds = atoi(words[4]), libraries = count - 7;
    Library *all = calloc(libraries, sizeof *all);
    for (int i = 0; i < libraries; i++) {
        open_library(&all[i], words[7 + i], words[6]);
        for (int flags = 0; flags < 4; flags++)
            all[i].scenes[flags] = commit(&all[i], (flags & 1 ? ROBUST : 0) | (flags & 2 ? FILTER : 0), &wall, &cpu);
    }
    make_sets(&all[0], atoi(words[3]), atoi(words[5]));
    for (Set *set = sets; set < sets + SETS; set++) {
        if (set->count < 256) continue;
        double times[2 * libraries][rounds + 1];
        float *found = calloc((size_t)set->count * 2 * libraries, sizeof *found);
        for (int round = 0; round <= rounds; round++) // The first one warms up, and is the quickest to forget.
            for (int i = 0; i < 2 * libraries; i++)
                times[i][round] = trace(&all[i / 2], all[i / 2].scenes[i % 2 + (set->own ? 2 : 0)], set, found + (size_t)i * set->count);
        for (int i = 0; i < 2 * libraries; i++) {
            uint32_t hits = 0, other = 0, far = 0;
            for (uint32_t k = 0; k < set->count; k++) { // Compared with the robust scene of the first library.
                float mine = found[(size_t)i * set->count + k], theirs = found[set->count + k];
                hits += mine < INFINITY, other += (mine < INFINITY) != (theirs < INFINITY);
                far += mine < INFINITY && theirs < INFINITY && fabsf(mine - theirs) > 1e-4f * theirs;
            }
            qsort(times[i] + 1, rounds, sizeof(double), by_value);
            printf("{\"set\": \"%s\", \"library\": \"%s\", \"robust\": %s, \"rays\": %u, \"ns\": %.1f, \"hits\": %u, \"other\": %u, "
                   "\"far\": %u}\n", set->name, all[i / 2].name, i % 2 ? "true" : "false", set->count,
                   times[i][(rounds + 1) / 2] / set->count * 1e9, hits, other, far);
        }
        free(found);
    }
    return 0;
}
