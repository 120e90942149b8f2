// C interface to TetGen's one function, for the worker program.
//
// TetGen's inline terminatetetgen() frees the mesh and then throws, after which the mesh's
// destructor frees it again. The header's definition is renamed away here, and one that only
// throws takes its place: for TetGen's sources by the same renaming (tetgen_source.cpp), for a shared
// library because the program's definition precedes the library's weak one.
#ifndef TETLIBRARY
#define TETLIBRARY
#endif

#define terminatetetgen terminatetetgen_of_the_header
#include <tetgen.h>
#undef terminatetetgen

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fcntl.h>
#include <limits>
#include <new>
#include <unistd.h>

__attribute__((visibility("default"), used)) void terminatetetgen(tetgenmesh *, int x) { throw x; }

extern "C" {

// TetGen writes files where it stands, for some switches and some failures. Here they go nowhere: the program's definition
// precedes the library's, so the worker needs no folder that somebody would have to remove when it is killed.
__attribute__((visibility("default"), used)) FILE *fopen(const char *, const char *mode) {
  const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
  FILE *file = null < 0 ? nullptr : fdopen(null, mode);
  if (!file && null >= 0) close(null);
  return file;
}

struct bth_result {
  tetgenio *out;
  const double *points;
  size_t point_count;
  const int *tets;
  size_t tet_count;
  char text[160];
};

void bth_tetgen_free(bth_result *result) {
  delete result->out;
  result->out = nullptr;
}

// Returns 0, TetGen's own code (1 memory, 2 internal, 3 intersection, 4 and 5 too small,
// 10 input), 100 for another exception or 101 for lists that are not there.
int bth_tetgen_run(const char *switches, const double *points, size_t point_count, const uint32_t *triangles,
                   size_t triangle_count, const uint32_t *quads, size_t quad_count, bth_result *result) {
  std::memset(result, 0, sizeof *result);
  const char *text = "";
  int code = 100;
  // TetGen counts in int, and allocates several per element.
  const size_t limit = std::numeric_limits<int>::max() / 64;
  if (point_count > limit || triangle_count > limit || quad_count > limit) return 10;
  try {
    tetgenio in;
    in.numberofpoints = (int)point_count;
    in.pointlist = new REAL[3 * point_count];
    std::memcpy(in.pointlist, points, 3 * point_count * sizeof(double));
    const size_t facets = triangle_count + quad_count;
    in.facetmarkerlist = new int[facets];
    in.facetlist = new tetgenio::facet[facets];
    // The destructor frees what numberoffacets says, so each facet is whole before it is counted.
    for (size_t i = 0; i < facets; i++) {
      const bool quad = i >= triangle_count;
      const int corners = quad ? 4 : 3;
      const uint32_t *from = quad ? quads + 4 * (i - triangle_count) : triangles + 3 * i;
      tetgenio::facet *facet = &in.facetlist[i];
      tetgenio::init(facet);
      facet->polygonlist = new tetgenio::polygon[1];
      facet->numberofpolygons = 1;
      tetgenio::init(&facet->polygonlist[0]);
      in.numberoffacets = (int)i + 1;
      facet->polygonlist[0].vertexlist = new int[corners];
      facet->polygonlist[0].numberofvertices = corners;
      for (int k = 0; k < corners; k++) facet->polygonlist[0].vertexlist[k] = (int)from[k];
      in.facetmarkerlist[i] = quad ? -(int)(i - triangle_count) - 1 : (int)i + 1;
    }
    result->out = new tetgenio;
    // TetGen takes char *, and 1.6 writes to it.
    char copy[256];
    std::strncpy(copy, switches, sizeof copy - 1);
    copy[sizeof copy - 1] = 0;
    tetrahedralize(copy, &in, result->out);
    result->points = result->out->pointlist;
    result->point_count = (size_t)result->out->numberofpoints;
    result->tets = result->out->tetrahedronlist;
    result->tet_count = (size_t)result->out->numberoftetrahedra;
    const bool whole = result->points && result->tets && result->out->numberofcorners == 4;
    code = whole ? 0 : 101;
    if (!whole) text = "TetGen returned no tetrahedra";
  } catch (int x) {
    code = x == 0 ? 100 : x;
    text = "TetGen stopped";
  } catch (const std::bad_alloc &) {
    code = 1;
    text = "out of memory";
  } catch (const std::exception &e) {
    std::strncpy(result->text, e.what(), sizeof result->text - 1);
    code = 100;
  } catch (...) {
    code = 100;
    text = "an unknown exception";
  }
  if (!result->text[0]) std::strncpy(result->text, text, sizeof result->text - 1);
  return code;
}
}
