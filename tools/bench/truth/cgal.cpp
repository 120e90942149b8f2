// CGAL's AABB tree, for `bth-bench truth`: with exact predicates ("CGAL"), and with exact constructions too
// ("CGAL exact"). src/truth/process.rs describes commands and files; `setup` builds this program.

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/version.h>
#include <cstdint>
#include <ctime>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <vector>

template <class T> static std::vector<T> read(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    std::vector<T> numbers(bytes.size() / sizeof(T));
    std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(T));
    return numbers;
}

template <class T> static void write(const std::string &path, const std::vector<T> &numbers) {
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char *>(numbers.data()), numbers.size() * sizeof(T));
}

template <class K> struct Engine {
    using Triangles = std::vector<typename K::Triangle_3>;
    using Primitive = CGAL::AABB_triangle_primitive<K, typename Triangles::const_iterator>;
    using Tree = CGAL::AABB_tree<CGAL::AABB_traits<K, Primitive>>;
    using Mesh = CGAL::Surface_mesh<typename K::Point_3>;
    using Side = CGAL::Side_of_triangle_mesh<Mesh, K>;

    std::string folder, query;
    Triangles triangles;
    std::unique_ptr<Tree> tree;
    Mesh mesh;
    std::unique_ptr<Side> side;
    std::vector<double> origins, directions;
    std::vector<uint32_t> own;

    static typename K::Point_3 point(const double *p) { return typename K::Point_3(p[0], p[1], p[2]); }

    const char *load(const std::string &from) {
        folder = from + "/";
        std::ifstream(folder + "query") >> query;
        const auto positions = read<double>(folder + "positions");
        const auto corners = read<uint32_t>(folder + "triangles");
        origins = read<double>(folder + "origins");
        directions = read<double>(folder + "directions");
        own = read<uint32_t>(folder + "own");
        side.reset();
        tree.reset();
        triangles.clear();
        mesh.clear();
        if (query == "inside") {
            for (size_t i = 0; i < positions.size(); i += 3) mesh.add_vertex(point(&positions[i]));
            using Vertex = typename Mesh::Vertex_index;
            for (size_t i = 0; i < corners.size(); i += 3)
                mesh.add_face(Vertex(corners[i]), Vertex(corners[i + 1]), Vertex(corners[i + 2]));
            side = std::make_unique<Side>(mesh);
            (*side)(point(&origins[0]));
            return nullptr;
        }
        for (size_t i = 0; i < corners.size(); i += 3)
            triangles.emplace_back(point(&positions[3 * corners[i]]), point(&positions[3 * corners[i + 1]]),
                                   point(&positions[3 * corners[i + 2]]));
        tree = std::make_unique<Tree>(triangles.cbegin(), triangles.cend());
        tree->build();
        return nullptr;
    }

    uint32_t id(typename Triangles::const_iterator found) const { return uint32_t(found - triangles.cbegin()); }

    void answer(size_t i, double &t, uint32_t &found) const {
        const auto origin = point(&origins[3 * i]);
        const uint32_t *skipped = &own[2 * i];
        if (query == "inside") {
            t = 0, found = (*side)(origin) == CGAL::ON_BOUNDED_SIDE;
            return;
        }
        const double *d = &directions[3 * i];
        const typename K::Vector_3 direction(d[0], d[1], d[2]);
        if (query == "visible") {
            std::vector<typename Tree::Primitive_id> blockers;
            tree->all_intersected_primitives(typename K::Segment_3(origin, origin + direction), std::back_inserter(blockers));
            t = 0, found = 1;
            for (auto blocker : blockers)
                if (id(blocker) != skipped[0] && id(blocker) != skipped[1]) found = 0;
            return;
        }
        const auto skip = [&](typename Tree::Primitive_id other) { return id(other) == skipped[0]; };
        const auto hit = tree->first_intersection(typename K::Ray_3(origin, direction), skip);
        t = std::numeric_limits<double>::infinity(), found = UINT32_MAX;
        if (!hit) return;
        found = id(hit->second);
        if (const auto *at = boost::get<typename K::Point_3>(&hit->first))
            t = CGAL::to_double(((*at - origin) * direction) / (direction * direction));
    }
};

static double seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

template <class K> static void serve() {
    std::cout << "ok " << CGAL_VERSION_STR << std::endl;
    Engine<K> engine;
    for (std::string line; std::getline(std::cin, line);) {
        try {
            const double start = seconds();
            if (line.rfind("load ", 0) == 0) {
                engine.load(line.substr(5));
                std::cout << "ok " << seconds() - start << std::endl;
                continue;
            }
            const size_t count = engine.origins.size() / 3;
            std::vector<double> t(count);
            std::vector<uint32_t> found(count);
            for (size_t i = 0; i < count; i++) engine.answer(i, t[i], found[i]);
            std::cout.flush();
            const double taken = seconds() - start;
            write(engine.folder + "t", t);
            write(engine.folder + "id", found);
            std::cout << "ok " << taken << std::endl;
        } catch (const std::exception &) {
            std::cout << "no refuses the input" << std::endl;
        }
    }
}

int main(int, char **arguments) {
    if (std::string(arguments[1]) == "CGAL exact") serve<CGAL::Exact_predicates_exact_constructions_kernel>();
    else serve<CGAL::Exact_predicates_inexact_constructions_kernel>();
}
