/* Reads tuples of numpy arrays into structs of views, by the names of their members; nothing is copied.
 *
 * An array of another type, rank or order, or one that may not be written where a loop writes, raises a TypeError that
 * names the member. The Python object outlives the views: a bound class keeps it.
 */
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <string>

#include "../layout.hpp"
#include "../view.hpp"

namespace gudgeon {

namespace nb = nanobind;

[[noreturn]] inline void refuse(const std::string& name, const char* expected) {
    throw nb::type_error((name + ": not " + expected).c_str());
}

template <class T, int N>
void read(const std::string& name, nb::handle value, View<T, N>& view) {
    nb::ndarray<T, nb::ndim<N>, nb::c_contig, nb::device::cpu> array;
    if (!nb::try_cast(value, array, false)) {
        refuse(name, "a contiguous array of this type and rank, writable where the loop writes");
    }
    view.data = array.data();
    for (int k = 0; k < N; ++k) view.shape[k] = Index(array.shape(k));
}

inline void read(const std::string& name, nb::handle value, double& number) {
    if (!nb::try_cast(value, number)) refuse(name, "a number");
}

inline void read(const std::string& name, nb::handle value, Index& number) {
    if (!nb::try_cast(value, number)) refuse(name, "an integer");
}

inline void read(const std::string& name, nb::handle value, bool& flag) {
    if (!nb::try_cast(value, flag)) refuse(name, "True or False");
}

template <class S>
    requires requires(S& s) { s.each([](const char*, auto&) {}); }
void read(const std::string& name, nb::handle value, S& out) {
    const std::string prefix = name.empty() ? name : name + ".";
    out.each([&](const char* member, auto& view) { read(prefix + member, value.attr(member), view); });
}

/* A struct of views, or one view, of a Python object. */
template <class S>
S read(nb::handle value, const char* name = "") {
    S out{};
    read(std::string(name), value, out);
    return out;
}

}  // namespace gudgeon
