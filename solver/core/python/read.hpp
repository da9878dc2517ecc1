/* Reads tuples of numpy arrays into structs of views, by the names of their members; nothing is copied.
 *
 * An array of another type, rank or order, or one that may not be written where a loop writes, raises a TypeError that
 * names the member; in the checked build an array of another shape than the struct declares raises a ValueError that
 * names it and what its shape must be. The Python object outlives the views: a bound class keeps it.
 */
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <string>
#include <string_view>
#include <vector>

#include "../layout.hpp"
#include "../view.hpp"

namespace gudgeon {

namespace nb = nanobind;

[[noreturn]] void refuse(const std::string& name, const char* expected);

/* Sizes by the letters of `GUDGEON_SHAPES`: the first array with a letter says what it is, others must agree. */
class Sizes {
public:
    /* Compare a shape with what is declared: the sizes of one array, or those of the members of a struct. */
    void compare(const std::string& name, std::string_view declared, const Index* shape, int rank);
    void compare(const std::string& name, std::string_view shapes, std::string_view member, const Index* shape,
                 int rank);

private:
    struct Size {
        std::string letter;
        Index value;
        std::string source;  /* The array that it was taken from. */
    };

    const Size* known(std::string_view letter) const noexcept;
    bool agrees(const std::string& name, std::string_view sum, Index size);

    std::vector<Size> sizes_;
};

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
void read(const std::string& name, nb::handle value, S& out, Sizes& sizes);

/* One function for each type of a member: inlined at every member, it is most of what a compiler works on. */
template <class V>
[[gnu::noinline]] void read_member(const std::string& table, nb::handle value, const char* member, const char* shapes,
                                   V& view, Sizes& sizes) {
    const std::string name = table.empty() ? member : table + "." + member;
    if constexpr (Table<V>) {
        read(name, value.attr(member), view, sizes);
    } else {
        read(name, value.attr(member), view);
        if constexpr (requires { V::dimensions; }) sizes.compare(name, shapes, member, view.shape, V::dimensions);
    }
}

template <Table S>
void read(const std::string& name, nb::handle value, S& out, Sizes& sizes) {
    const char* shapes = "";
    if constexpr (requires { S::shapes; }) shapes = S::shapes;
    out.each([&](const char* member, auto& view) { read_member(name, value, member, shapes, view, sizes); });
}

/* A struct of views of a Python object; structs that share sizes are read with the same `Sizes`. */
template <Table S>
S read(nb::handle value, Sizes& sizes, const char* name = "") {
    S out{};
    read(std::string(name), value, out, sizes);
    return out;
}

template <Table S>
S read(nb::handle value, const char* name = "") {
    Sizes sizes;
    return read<S>(value, sizes, name);
}

/* A view of a Python object, whose shape is compared where it is declared. */
template <class V>
V read(nb::handle value, const char* name) {
    V out{};
    read(std::string(name), value, out);
    return out;
}

template <class V>
V read(nb::handle value, Sizes& sizes, const char* name, const char* declared) {
    const V out = read<V>(value, name);
    sizes.compare(name, declared, out.shape, V::dimensions);
    return out;
}

}  // namespace gudgeon
