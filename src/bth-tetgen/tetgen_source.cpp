// TetGen compiled in, with the terminatetetgen() that shim.cpp defines in place of the header's.
#define terminatetetgen terminatetetgen_of_the_header
#include <tetgen.h>
#undef terminatetetgen
void terminatetetgen(tetgenmesh *m, int x);
#include <tetgen.cxx>
