/* The extension: each subject binds what Python calls of it in a file of its own. */
#include <nanobind/nanobind.h>

#include "../view.hpp"
#include "digests.hpp"

namespace nb = nanobind;

void bind_small(nb::module_&);
void bind_implicit(nb::module_&);
void bind_turning(nb::module_&);
void bind_laws(nb::module_&);
void bind_response(nb::module_&);
void bind_log(nb::module_&);
void bind_fields(nb::module_&);
void bind_signals(nb::module_&);
void bind_panels(nb::module_&);
void bind_tool(nb::module_&);
void bind_points(nb::module_&);

#define GUDGEON_EXTENSION(name, variable) NB_MODULE(name, variable)

GUDGEON_EXTENSION(GUDGEON_MODULE, m) {
    m.doc() = "Time loops of gudgeon's solver.";
    bind_small(m);
    bind_implicit(m);
    bind_turning(m);
    bind_laws(m);
    bind_response(m);
    bind_log(m);
    bind_fields(m);
    bind_signals(m);
    bind_panels(m);
    bind_tool(m);
    bind_points(m);
    m.attr("sources") = GUDGEON_SOURCES;
#ifdef GUDGEON_CHECKED
    m.attr("checked") = true;
    m.def("accesses", [] { return gudgeon::accesses; }, "Entries, rows and ranges of arrays that were taken so far.");
#else
    m.attr("checked") = false;
    nb::set_leak_warnings(false); /* At exit frames of daemon threads hold runs; the checked build tells of them. */
#endif
}
