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

[[noreturn]] void refuse(const std::string& name, const char* expected);

/* The pointer and the shape of a view, and what its array must be. */
struct Target {
    const void*& data;
    Index* shape;
    int rank;
    nb::dlpack::dtype type;
    bool written;
};

void read_view(const std::string& name, nb::handle value, Target target);
void read(const std::string& name, nb::handle value, double& number);
void read(const std::string& name, nb::handle value, Index& number);
void read(const std::string& name, nb::handle value, bool& flag);

template <class T, int N>
void read(const std::string& name, nb::handle value, View<T, N>& view) {
    const void* data = nullptr;
    read_view(name, value, {data, view.shape, N, nb::dtype<std::remove_const_t<T>>(), !std::is_const_v<T>});
    view.data = static_cast<T*>(const_cast<void*>(data));
}

/* A struct that lists its members. */
template <class S>
concept Table = requires(S& s) { s.each([](const char*, auto&) {}); };

template <Table S>
void read(const std::string& name, nb::handle value, S& out);

/* One function for each type of a member: inlined at every member, it is most of what a compiler works on. */
template <class V>
[[gnu::noinline]] void read_member(const std::string& name, nb::handle value, const char* member, V& view) {
    read(name.empty() ? member : name + "." + member, value.attr(member), view);
}

template <Table S>
void read(const std::string& name, nb::handle value, S& out) {
    out.each([&](const char* member, auto& view) { read_member(name, value, member, view); });
}

/* A struct of views, or one view, of a Python object. */
template <class S>
S read(nb::handle value, const char* name = "") {
    S out{};
    read(std::string(name), value, out);
    return out;
}

}  // namespace gudgeon
