/* Records the rays that a program traces with Embree 4, and the triangles that they are traced
 * against.
 *
 *   LD_PRELOAD=record_rays.so BTH_RECORD=FOLDER PROGRAM
 *
 * The program must load Embree as a shared library (`libembree4*`). The scene of the first ray is
 * recorded; rays against other scenes are only counted. The scene must consist of triangles without
 * instances and motion. At exit the folder holds
 *
 *   model.ply                 its triangles, geometry by geometry, in the order of attachment
 *   nearest.rays, any.rays    the rays of each query, thread by thread, in the order of tracing
 *   nearest.from, any.from    the triangle that each ray starts on, where that is known
 *   recording.txt             what was recorded and what was skipped
 *
 * in the formats that docs/reference.md describes. BTH_RECORD_LIMIT=N stops after N rays
 * (2,000,000). BTH_RECORD_FROM=cycles reads from the query's context on which triangle a ray starts:
 * Blender's Cycles keeps that there. Ray masks and filters are not recorded. The types below follow
 * Embree's public C interface.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <link.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TYPE_TRIANGLE = 0, BUFFER_INDEX = 0, BUFFER_VERTEX = 1, MOST_FILTERS = 8 };
static const uint32_t NONE = UINT32_MAX;

struct buffer {
    size_t stride, count;
};
struct geometry {
    void *handle;
    int type;
    unsigned steps;
    struct buffer buffers[2];
};
struct attachment {
    void *scene, *geometry;
    unsigned id;
};
struct traversable {
    void *scene, *handle;
};
/* A geometry of the recorded scene. */
struct part {
    unsigned id;
    size_t first, count;
    intptr_t user_data;
};
struct ray {
    float values[8];
    uint32_t from;
};
/* The rays of a thread: for the nearest hit, and for any hit. */
struct thread {
    struct thread *next;
    struct list {
        struct ray *rays;
        size_t count, capacity;
    } lists[2];
};

/* A growing array of any of the structures above. */
#define LIST(type) struct { type *items; size_t count, capacity; }
#define PUSH(list, ...) \
    do { \
        if ((list).count == (list).capacity) { \
            (list).capacity = (list).capacity * 2 + 16; \
            (list).items = grown((list).items, (list).capacity * sizeof *(list).items); \
        } \
        (list).items[(list).count++] = (__VA_ARGS__); \
    } while (0)

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static LIST(struct geometry) geometries;
static LIST(struct attachment) attachments;
static LIST(struct traversable) traversables;
static LIST(struct part) parts;
static LIST(uint32_t) part_of_id;
static LIST(float) positions;
static LIST(uint32_t) corners;
static struct thread *threads;
static __thread struct thread *own_thread;
/* Embree may call its own public functions. */
static __thread int inside;

/* The recorded scene, its other handle, and whether it can be recorded. */
static _Atomic(void *) scene_seen;
static void *scene_traversable;
static const char *refused;
static atomic_int stopped;
static atomic_size_t taken, beyond_limit, in_other_scenes, after_change, odd_contexts;
static struct filter {
    _Atomic(void *) function;
    atomic_size_t rays;
} filters[MOST_FILTERS];

static void fail(const char *what) {
    fprintf(stderr, "record_rays: %s\n", what);
    exit(1);
}

static void *grown(void *old, size_t bytes) {
    void *memory = realloc(old, bytes);
    if (!memory) fail("out of memory");
    return memory;
}

static int find_embree(struct dl_phdr_info *info, size_t size, void *found) {
    (void)size;
    if (!info->dlpi_name || !strstr(info->dlpi_name, "libembree4")) return 0;
    *(void **)found = dlopen(info->dlpi_name, RTLD_LAZY | RTLD_NOLOAD);
    return *(void **)found != NULL;
}

/* The real function. RTLD_NEXT does not find the library if a Python module loads it: it is not global. */
static void *real_function(const char *name) {
    void *library = NULL;
    dl_iterate_phdr(find_embree, &library);
    void *function = library ? dlsym(library, name) : NULL;
    if (!function) fail("no libembree4 with the function that was called");
    return function;
}
#define REAL(name) \
    static _Atomic(__typeof__(&name)) real; \
    if (!real) real = (__typeof__(&name))real_function(#name)

/* ---- The scenes ---- */

static struct geometry *geometry_of(void *handle) {
    for (size_t i = geometries.count; i-- > 0;)
        if (geometries.items[i].handle == handle) return &geometries.items[i];
    return NULL;
}

void *rtcNewGeometry(void *device, int type) {
    REAL(rtcNewGeometry);
    void *handle = real(device, type);
    pthread_mutex_lock(&lock);
    struct geometry made = {handle, type, 1, {{0, 0}, {0, 0}}}, *old = geometry_of(handle);
    if (old)
        *old = made; /* The old one is gone. */
    else
        PUSH(geometries, made);
    pthread_mutex_unlock(&lock);
    return handle;
}

void rtcSetGeometryTimeStepCount(void *handle, unsigned steps) {
    REAL(rtcSetGeometryTimeStepCount);
    pthread_mutex_lock(&lock);
    struct geometry *geometry = geometry_of(handle);
    if (geometry) geometry->steps = steps;
    pthread_mutex_unlock(&lock);
    real(handle, steps);
}

static void note_buffer(void *handle, int type, unsigned slot, size_t stride, size_t count) {
    if (slot != 0 || (type != BUFFER_INDEX && type != BUFFER_VERTEX)) return;
    pthread_mutex_lock(&lock);
    struct geometry *geometry = geometry_of(handle);
    if (geometry) geometry->buffers[type] = (struct buffer){stride, count};
    pthread_mutex_unlock(&lock);
}

void rtcSetGeometryBuffer(void *geometry, int type, unsigned slot, int format, void *buffer, size_t offset,
                          size_t stride, size_t count) {
    REAL(rtcSetGeometryBuffer);
    note_buffer(geometry, type, slot, stride, count);
    real(geometry, type, slot, format, buffer, offset, stride, count);
}

void rtcSetSharedGeometryBuffer(void *geometry, int type, unsigned slot, int format, const void *data,
                                size_t offset, size_t stride, size_t count) {
    REAL(rtcSetSharedGeometryBuffer);
    note_buffer(geometry, type, slot, stride, count);
    real(geometry, type, slot, format, data, offset, stride, count);
}

void rtcSetSharedGeometryBufferHostDevice(void *geometry, int type, unsigned slot, int format,
                                          const void *host, const void *device, size_t offset,
                                          size_t stride, size_t count) {
    REAL(rtcSetSharedGeometryBufferHostDevice);
    note_buffer(geometry, type, slot, stride, count);
    real(geometry, type, slot, format, host, device, offset, stride, count);
}

void *rtcSetNewGeometryBuffer(void *geometry, int type, unsigned slot, int format, size_t stride,
                              size_t count) {
    REAL(rtcSetNewGeometryBuffer);
    note_buffer(geometry, type, slot, stride, count);
    return real(geometry, type, slot, format, stride, count);
}

void rtcSetNewGeometryBufferHostDevice(void *geometry, int type, unsigned slot, int format, size_t stride,
                                       size_t count, void **host, void **device) {
    REAL(rtcSetNewGeometryBufferHostDevice);
    note_buffer(geometry, type, slot, stride, count);
    real(geometry, type, slot, format, stride, count, host, device);
}

/* Forgets the attachment of a number to a scene, or all of them. */
static void detach(void *scene, unsigned id, int all) {
    size_t kept = 0;
    for (size_t i = 0; i < attachments.count; i++) {
        struct attachment it = attachments.items[i];
        if (it.scene != scene || (!all && it.id != id)) attachments.items[kept++] = it;
    }
    attachments.count = kept;
}

void *rtcNewScene(void *device) {
    REAL(rtcNewScene);
    void *scene = real(device);
    pthread_mutex_lock(&lock);
    detach(scene, 0, 1); /* Of an old scene at the same place. */
    pthread_mutex_unlock(&lock);
    return scene;
}

static void attach(void *scene, void *geometry, unsigned id) {
    pthread_mutex_lock(&lock);
    detach(scene, id, 0);
    PUSH(attachments, (struct attachment){scene, geometry, id});
    pthread_mutex_unlock(&lock);
}

unsigned rtcAttachGeometry(void *scene, void *geometry) {
    REAL(rtcAttachGeometry);
    unsigned id = real(scene, geometry);
    attach(scene, geometry, id);
    return id;
}

void rtcAttachGeometryByID(void *scene, void *geometry, unsigned id) {
    REAL(rtcAttachGeometryByID);
    real(scene, geometry, id);
    attach(scene, geometry, id);
}

void rtcDetachGeometry(void *scene, unsigned id) {
    REAL(rtcDetachGeometry);
    pthread_mutex_lock(&lock);
    detach(scene, id, 0);
    pthread_mutex_unlock(&lock);
    real(scene, id);
}

void *rtcGetSceneTraversable(void *scene) {
    REAL(rtcGetSceneTraversable);
    struct traversable made = {scene, real(scene)};
    pthread_mutex_lock(&lock);
    PUSH(traversables, made);
    pthread_mutex_unlock(&lock);
    return made.handle;
}

/* Other triangles than the recorded ones: what comes then is not recorded. */
static void scene_changes(void *scene) {
    if (scene == atomic_load(&scene_seen)) atomic_store(&stopped, 1);
}

void rtcCommitScene(void *scene) {
    REAL(rtcCommitScene);
    scene_changes(scene);
    real(scene);
}

void rtcJoinCommitScene(void *scene) {
    REAL(rtcJoinCommitScene);
    scene_changes(scene);
    real(scene);
}

/* Copies the triangles of a geometry. */
static const char *copy_part(const struct attachment *attachment) {
    void *(*data)(void *, int, unsigned) = real_function("rtcGetGeometryBufferData");
    void *(*user_data)(void *) = real_function("rtcGetGeometryUserData");
    const struct geometry *geometry = geometry_of(attachment->geometry);
    if (!geometry || geometry->type != TYPE_TRIANGLE) return "it holds other geometries than triangles";
    if (geometry->steps != 1) return "it holds geometries that move";
    struct buffer index = geometry->buffers[BUFFER_INDEX], vertex = geometry->buffers[BUFFER_VERTEX];
    const char *indices = data(geometry->handle, BUFFER_INDEX, 0);
    const char *vertices = data(geometry->handle, BUFFER_VERTEX, 0);
    if (!indices || !vertices) return "it holds geometries without buffers";
    size_t first = corners.count / 3, base = positions.count / 3;
    uint32_t used = 0;
    for (size_t i = 0; i < index.count; i++) {
        uint32_t triangle[3];
        memcpy(triangle, indices + i * index.stride, sizeof triangle);
        for (int k = 0; k < 3; k++) {
            if (triangle[k] >= vertex.count) return "it holds triangles without vertices";
            if (triangle[k] >= used) used = triangle[k] + 1;
            PUSH(corners, (uint32_t)(base + triangle[k]));
        }
    }
    for (size_t i = 0; i < used; i++) {
        float position[3];
        memcpy(position, vertices + i * vertex.stride, sizeof position);
        for (int k = 0; k < 3; k++) PUSH(positions, position[k]);
    }
    while (part_of_id.count <= attachment->id) PUSH(part_of_id, NONE);
    part_of_id.items[attachment->id] = (uint32_t)parts.count;
    intptr_t user = (intptr_t)user_data(geometry->handle);
    PUSH(parts, (struct part){attachment->id, first, index.count, user});
    return NULL;
}

/* The scene of the first ray is the one that is recorded: copies its triangles. */
static void choose_scene(void *handle) {
    pthread_mutex_lock(&lock);
    if (!atomic_load(&scene_seen)) {
        void *scene = handle;
        for (size_t i = 0; i < traversables.count; i++)
            if (traversables.items[i].handle == handle) scene = traversables.items[i].scene;
        for (size_t i = 0; i < attachments.count && !refused; i++)
            if (attachments.items[i].scene == scene) refused = copy_part(&attachments.items[i]);
        scene_traversable = handle;
        if (refused) atomic_store(&stopped, 1);
        atomic_store(&scene_seen, scene);
    }
    pthread_mutex_unlock(&lock);
}

/* ---- The rays ---- */

/* What `BTH_RECORD_FROM=cycles` reads: the context of Cycles' queries begins so after Embree's part of it. */
struct cycles_ray {
    float origin[4], direction[4], tmin, tmax, time, differentials[2];
    int32_t own_primitive, own_object;
};
struct cycles_context {
    uint32_t instance[2];
    void *globals;
    const struct cycles_ray *ray;
};
/* How the arguments of a query begin. */
struct arguments {
    int flags;
    unsigned features;
    void *context, *filter;
};

/* The triangle on which a ray starts: a geometry has twice the number of its object, and its user
 * data is the number of its first primitive. */
static uint32_t from_cycles(const struct arguments *arguments, const float values[8]) {
    if (!arguments || !arguments->context) return NONE;
    const struct cycles_ray *ray = ((const struct cycles_context *)arguments->context)->ray;
    if (!ray || memcmp(ray->origin, values, 12) || memcmp(ray->direction, values + 4, 12)
        || ray->tmax != values[7]) {
        odd_contexts++;
        return NONE;
    }
    size_t id = 2 * (size_t)ray->own_object;
    if (ray->own_object < 0 || id >= part_of_id.count || part_of_id.items[id] == NONE) return NONE;
    const struct part *part = &parts.items[part_of_id.items[id]];
    intptr_t triangle = ray->own_primitive - part->user_data;
    return triangle >= 0 && (size_t)triangle < part->count ? (uint32_t)(part->first + triangle) : NONE;
}

static size_t limit = 2000000;
static int is_cycles;
static const char *folder;

__attribute__((constructor)) static void start(void) {
    const char *from = getenv("BTH_RECORD_FROM"), *most = getenv("BTH_RECORD_LIMIT");
    folder = getenv("BTH_RECORD");
    is_cycles = from && !strcmp(from, "cycles");
    if (most) limit = strtoull(most, NULL, 10);
    if (!folder) atomic_store(&stopped, 1);
}

static void count_filter(void *function) {
    for (int i = 0; i < MOST_FILTERS; i++) {
        void *empty = NULL;
        if (atomic_load(&filters[i].function) == function
            || atomic_compare_exchange_strong(&filters[i].function, &empty, function) || empty == function) {
            filters[i].rays++;
            return;
        }
    }
}

/* Records the ray of a lane, unless it is inactive. */
static void record_lane(const float *data, int width, int lane, int any, const struct arguments *arguments) {
    /* Origin, tnear, direction and tfar of Embree's ray. */
    static const int PLACES[8] = {0, 1, 2, 3, 4, 5, 6, 8};
    struct ray ray = {.from = NONE};
    for (int k = 0; k < 8; k++) ray.values[k] = data[PLACES[k] * width + lane];
    if (!(ray.values[3] <= ray.values[7])) return;
    if (atomic_fetch_add(&taken, 1) >= limit) {
        beyond_limit++;
        return;
    }
    if (is_cycles) ray.from = from_cycles(arguments, ray.values);
    if (any) count_filter(arguments ? arguments->filter : NULL);
    if (!own_thread) {
        own_thread = grown(NULL, sizeof *own_thread);
        memset(own_thread, 0, sizeof *own_thread);
        pthread_mutex_lock(&lock);
        struct thread **end = &threads;
        while (*end) end = &(*end)->next;
        *end = own_thread;
        pthread_mutex_unlock(&lock);
    }
    struct list *list = &own_thread->lists[any];
    if (list->count == list->capacity) {
        list->capacity = list->capacity * 2 + 4096;
        list->rays = grown(list->rays, list->capacity * sizeof ray);
    }
    list->rays[list->count++] = ray;
}

static void record(const int *valid, void *scene, const void *data, int width, int any,
                   const void *arguments) {
    if (inside || !folder) return;
    if (!atomic_load(&scene_seen)) choose_scene(scene);
    if (scene != atomic_load(&scene_seen) && scene != scene_traversable) {
        in_other_scenes++;
    } else if (atomic_load(&stopped)) {
        after_change++;
    } else {
        for (int lane = 0; lane < width; lane++)
            if (!valid || valid[lane] == -1) record_lane(data, width, lane, any, arguments);
    }
}

#define SINGLE(name, any) \
    void name(void *scene, void *ray, void *arguments) { \
        REAL(name); \
        record(NULL, scene, ray, 1, any, arguments); \
        inside++; \
        real(scene, ray, arguments); \
        inside--; \
    }
#define PACKET(name, width, any) \
    void name(const int *valid, void *scene, void *rays, void *arguments) { \
        REAL(name); \
        record(valid, scene, rays, width, any, arguments); \
        inside++; \
        real(valid, scene, rays, arguments); \
        inside--; \
    }
SINGLE(rtcIntersect1, 0)
SINGLE(rtcOccluded1, 1)
SINGLE(rtcTraversableIntersect1, 0)
SINGLE(rtcTraversableOccluded1, 1)
#define PACKETS(width) \
    PACKET(rtcIntersect##width, width, 0) \
    PACKET(rtcOccluded##width, width, 1) \
    PACKET(rtcTraversableIntersect##width, width, 0) \
    PACKET(rtcTraversableOccluded##width, width, 1)
PACKETS(4)
PACKETS(8)
PACKETS(16)

/* ---- The files ---- */

static FILE *create(const char *name) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    if (!file) fprintf(stderr, "record_rays: cannot write %s\n", path);
    return file;
}

static void write_header(FILE *file, const char *tag, uint64_t count) {
    uint32_t version = 1;
    fwrite(tag, 4, 1, file);
    fwrite(&version, 4, 1, file);
    fwrite(&count, 8, 1, file);
}

static void write_model(void) {
    FILE *file = create("model.ply");
    if (!file) return;
    fprintf(file, "ply\nformat binary_little_endian 1.0\nelement vertex %zu\n", positions.count / 3);
    fprintf(file, "property float x\nproperty float y\nproperty float z\n");
    fprintf(file, "element face %zu\nproperty list uchar uint vertex_indices\n", corners.count / 3);
    fprintf(file, "end_header\n");
    fwrite(positions.items, 4, positions.count, file);
    for (size_t i = 0; i < corners.count; i += 3) {
        fputc(3, file);
        fwrite(corners.items + i, 4, 3, file);
    }
    fclose(file);
}

/* Writes the rays of a kind; returns how many, and of how many the start is known. */
static size_t write_rays(int any, size_t *known) {
    size_t count = 0;
    for (struct thread *thread = threads; thread; thread = thread->next) count += thread->lists[any].count;
    FILE *rays = create(any ? "any.rays" : "nearest.rays");
    FILE *from = create(any ? "any.from" : "nearest.from");
    if (!rays || !from) return 0;
    write_header(rays, "RAYS", count);
    write_header(from, "FROM", count);
    for (struct thread *thread = threads; thread; thread = thread->next) {
        for (size_t i = 0; i < thread->lists[any].count; i++) {
            const struct ray *ray = &thread->lists[any].rays[i];
            *known += ray->from != NONE;
            fwrite(ray->values, sizeof ray->values, 1, rays);
            fwrite(&ray->from, 4, 1, from);
        }
    }
    fclose(rays);
    fclose(from);
    return count;
}

__attribute__((destructor)) static void finish(void) {
    if (!folder || !atomic_load(&scene_seen)) return;
    atomic_store(&stopped, 1);
    size_t known[2] = {0, 0}, counts[2] = {0, 0};
    if (!refused) {
        write_model();
        for (int any = 0; any < 2; any++) counts[any] = write_rays(any, &known[any]);
    }
    FILE *file = create("recording.txt");
    if (!file) return;
    if (refused) fprintf(file, "nothing recorded of the scene: %s\n", refused);
    fprintf(file, "triangles: %zu of %zu geometries\n", corners.count / 3, parts.count);
    fprintf(file, "nearest hit: %zu rays, of %zu it is known where they start\n", counts[0], known[0]);
    fprintf(file, "any hit: %zu rays, of %zu it is known where they start\n", counts[1], known[1]);
    for (int i = 0; i < MOST_FILTERS && filters[i].rays; i++)
        fprintf(file, "any hit, filter %d: %zu rays\n", i, filters[i].rays);
    fprintf(file, "skipped: %zu rays beyond the limit, %zu calls in other scenes, ", beyond_limit,
            in_other_scenes);
    fprintf(file, "%zu calls after the scene changed\n", after_change);
    if (odd_contexts) fprintf(file, "contexts that are not as expected: %zu\n", odd_contexts);
    fclose(file);
}
