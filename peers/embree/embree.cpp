// Embree's side of run.py: its rays and its building, on triangles and rays from files.
//
// The library is loaded when this runs, and the few types of its interface that are used here are
// declared below, so that no headers are needed. They are those of Embree 4.4.
//
// usage: embree LIBRARY PATH QUALITY, where QUALITY is 1 (medium, Embree's default) or 2 (high).
// Each line of output is what was done, by which call, the processor seconds, and how many
// hits or triangles there were.
#include <dlfcn.h>
#include <time.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace {

constexpr unsigned kNothing = 0xffffffff;  // RTC_INVALID_GEOMETRY_ID
constexpr int kTriangles = 0, kIndices = 0, kVertices = 1;
constexpr int kUint3 = 0x5003, kFloat3 = 0x9003;
constexpr int kCoherent = 1 << 16;

// RTCRay, RTCHit and RTCRayHit for one ray, or for packets of 8 or 16.
template <int N> struct alignas(N == 1 ? 16 : 4 * N) Rays {
    float origin[3][N], near[N], direction[3][N], time[N], far[N];
    unsigned mask[N], id[N], flags[N];
};
template <int N> struct alignas(N == 1 ? 16 : 4 * N) Hits {
    float normal[3][N], u[N], v[N];
    unsigned primitive[N], geometry[N], instance[N], instance_primitive[N];
};
template <int N> struct RayHits {
    Rays<N> rays;
    Hits<N> hits;
};
struct Arguments {  // RTCOccludedArguments and RTCIntersectArguments
    int flags;
    int features;
    void *context, *filter, *function;
};

void *library;

// Calls a function of the library, which returns R, by its name.
template <class R = void, class... A> R call(const char *name, A... arguments) {
    void *function = dlsym(library, name);
    if (!function) {
        fprintf(stderr, "the library has no %s\n", name);
        exit(1);
    }
    return reinterpret_cast<R (*)(A...)>(function)(arguments...);
}

double processor_seconds() {
    timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return time.tv_sec + 1e-9 * time.tv_nsec;
}

// Prints the processor time of the second of two runs, and the number that it returns.
template <class Run> void measure(const char *what, const std::string &name, Run run) {
    run();
    double start = processor_seconds();
    size_t count = run();
    printf("%s %s %e %zu\n", what, name.c_str(), processor_seconds() - start, count);
}

template <class T> std::vector<T> read(const std::string &path) {
    FILE *file = fopen(path.c_str(), "rb");
    if (!file) {
        perror(path.c_str());
        exit(1);
    }
    std::vector<T> all;
    T some[4096];
    while (size_t count = fread(some, sizeof(T), 4096, file)) {
        all.insert(all.end(), some, some + count);
    }
    fclose(file);
    return all;
}

// A scene with the triangles, not yet built.
void *scene_of(void *device, const std::vector<float> &positions,
               const std::vector<unsigned> &triangles, int quality) {
    void *scene = call<void *>("rtcNewScene", device);
    call("rtcSetSceneBuildQuality", scene, quality);
    void *geometry = call<void *>("rtcNewGeometry", device, kTriangles);
    auto fill = [&](int kind, int format, const void *data, size_t count) {
        void *buffer = call<void *>(
            "rtcSetNewGeometryBuffer", geometry, kind, 0u, format, size_t(12), count);
        memcpy(buffer, data, 12 * count);
    };
    fill(kVertices, kFloat3, positions.data(), positions.size() / 3);
    fill(kIndices, kUint3, triangles.data(), triangles.size() / 3);
    call("rtcCommitGeometry", geometry);
    call<unsigned>("rtcAttachGeometry", scene, geometry);
    call("rtcReleaseGeometry", geometry);
    return scene;
}

// Traces rays of eight numbers each (origin, least t, direction, largest t) in packets of N, and
// returns how many meet something.
template <int N>
size_t trace(void *scene, const std::vector<float> &all, bool closest, int flags) {
    static const std::string width = std::to_string(N);
    static void *occluded = dlsym(library, ("rtcOccluded" + width).c_str());
    static void *intersect = dlsym(library, ("rtcIntersect" + width).c_str());
    void *function = closest ? intersect : occluded;
    Arguments arguments{flags, -1, nullptr, nullptr, nullptr};
    alignas(64) int valid[N];
    RayHits<N> packet;
    size_t count = all.size() / 8, hits = 0;
    for (size_t first = 0; first < count; first += N) {
        Rays<N> &rays = packet.rays;
        for (int i = 0; i < N; i++) {
            valid[i] = first + i < count ? -1 : 0;
            const float *ray = &all[8 * (valid[i] ? first + i : first)];
            for (int axis = 0; axis < 3; axis++) {
                rays.origin[axis][i] = ray[axis];
                rays.direction[axis][i] = ray[4 + axis];
            }
            rays.near[i] = ray[3];
            rays.far[i] = ray[7];
            rays.time[i] = 0;
            rays.mask[i] = -1;
            rays.id[i] = rays.flags[i] = 0;
            packet.hits.geometry[i] = packet.hits.instance[i] = kNothing;
        }
        if constexpr (N == 1) {
            using Function = void (*)(void *, void *, Arguments *);
            reinterpret_cast<Function>(function)(scene, &packet, &arguments);
        } else {
            using Function = void (*)(const int *, void *, void *, Arguments *);
            reinterpret_cast<Function>(function)(valid, scene, &packet, &arguments);
        }
        for (int i = 0; i < N; i++) {
            // A hidden ray comes back with a largest t of minus infinity.
            bool met = closest ? packet.hits.geometry[i] != kNothing : rays.far[i] < 0;
            hits += valid[i] && met;
        }
    }
    return hits;
}

}  // namespace

int main(int count, char **arguments) {
    if (count != 4) {
        fprintf(stderr, "usage: embree LIBRARY PATH QUALITY\n");
        return 2;
    }
    library = dlopen(arguments[1], RTLD_NOW | RTLD_GLOBAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    std::string path = arguments[2];
    int quality = atoi(arguments[3]);
    void *device = call<void *>("rtcNewDevice", "threads=1,set_affinity=0");
    void *scene = nullptr;
    auto positions = read<float>(path + ".positions");
    auto triangles = read<unsigned>(path + ".triangles");
    double seconds = 0;
    for (int run = 0; run < 2; run++) {
        if (scene) {
            call("rtcReleaseScene", scene);
        }
        scene = scene_of(device, positions, triangles, quality);
        double start = processor_seconds();
        call("rtcCommitScene", scene);
        seconds = processor_seconds() - start;
    }
    printf("build rtcCommitScene %e %zu\n", seconds, triangles.size() / 3);
    for (const char *kind : {"random", "camera", "fan", "view"}) {
        auto rays = read<float>(path + "." + kind);
        bool closest = !strcmp(kind, "view");
        for (int flags : {0, kCoherent}) {
            const char *how = flags ? "-coherent" : "";
            std::string name = std::string(closest ? "rtcIntersect" : "rtcOccluded");
            auto run = [&](const char *width, auto function) {
                measure(kind, name + width + how, [&] {
                    return function(scene, rays, closest, flags);
                });
            };
            run("1", trace<1>);
            run("8", trace<8>);
            run("16", trace<16>);
        }
    }
}
