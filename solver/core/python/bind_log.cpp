/* The log of impacts, where Python feeds or ends it. */
#include "../log/jumps.hpp"
#include "read.hpp"

using namespace gudgeon;

namespace {

void add_step(nb::handle log, Index number) { log_step(read<ImpactLog>(log), number); }

void finish(nb::handle log, Index contact) {
    const auto views = read<ImpactLog>(log);
    complete_impact(views, contact);
    finish_impact(views.running[contact], views.before[contact], views.sudden[contact], views.plateau[contact],
                  views.window[contact]);
}

}  // namespace

void bind_log(nb::module_& m) {
    m.def("log_step", &add_step, nb::arg("log"), nb::arg("number"),
          "Add the resultants of a step to the present impacts of an `ImpactLog`, and end those that are over.");
    m.def("finish_impact", &finish, nb::arg("log"), nb::arg("contact"),
          "Set impulse and windowed force of a contact's present impact as if no force followed.");
}
